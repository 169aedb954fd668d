"""The real RC manager, RCs and ARCs; they record the events of each hold, gate and packet in an audit.

Rule of this file: no decisions. Each overriding method records, then calls the original method.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.component.messages import Absence
from backbone.errors import Refusal
from backbone.rc_manager.service import RcManager
from backbone.scheduling.events import Event, Instruction, Record
from mission_control.laboratory.simulation.audit import Audit, current_audit
from resource_pool.aggregate_resource_controller import AggregateResourceController
from resource_pool.arcs.capture import CaptureArc
from resource_pool.arcs.drive import DriveArc
from resource_pool.arcs.video_drive import VideoDriveArc
from resource_pool.drivers.interface import DriverSite, HardwareFault, Picture
from resource_pool.gate import Gate
from resource_pool.holds import Hold
from resource_pool.rcs.command_radio import CommandRadio
from resource_pool.rcs.framegrabber import Framegrabber, FramegrabberParameters
from resource_pool.rcs.robot import RobotParameters
from resource_pool.rcs.scout import Scout
from resource_pool.rcs.video_frequency import VideoFrequency
from resource_pool.resource_controller import RcParameters, ResourceController

R = TypeVar("R", bound=RcParameters)


class AuditedRadio:
    """A radio that records its packets; no robot receives them."""

    def __init__(self, site: DriverSite) -> None:
        self._name, self._audit = site.resource, current_audit.get()

    async def open(self) -> None:
        """Do nothing: there is no device."""

    async def transmit(
        self,
        network_id: int,
        payload: bytes,
        *,
        arc: str,
        robot_epoch: int,
        robot_stop: int = 0,  # noqa: ARG002  no operator stops robots there
    ) -> None:
        """Record the packet."""
        command = payload[:1].decode("ascii")
        self._audit.note(self._name, "packet", robot=network_id, command=command, arc=arc, epoch=robot_epoch)

    async def close(self) -> None:
        """Do nothing: no device is open."""


class AuditedGrabber:
    """A receiver that takes no pictures."""

    def __init__(self, site: DriverSite) -> None:
        self._name, self._audit = site.resource, current_audit.get()

    async def open(self) -> None:
        """Do nothing: there is no device."""

    def tune(self, frequency: str, deliver: Callable[[Picture], None]) -> None:  # noqa: ARG002
        """Record the frequency."""
        self._audit.note(self._name, "tuned", frequency=frequency)

    def stop(self) -> None:
        """Record the stop."""
        self._audit.note(self._name, "stopped")

    async def close(self) -> None:
        """Do nothing: no device is open."""


class AuditedRc(ResourceController[R]):
    """Records the begin and end of each hold, and its safe state."""

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._audit = current_audit.get()

    async def connected(self, hold: Hold) -> None:
        """Record the hold; see ``ResourceController.connected``."""
        self._audit.note(self.name, "held", arc=hold.arc, epoch=hold.epoch)
        try:
            await super().connected(hold)
        except Refusal:
            self._audit.note(self.name, "let go", arc=hold.arc, epoch=hold.epoch)
            raise

    async def make_safe(self, hold: Hold) -> None:
        """Record the end of the hold, then its safe state or fault; see ``ResourceController.make_safe``."""
        self._audit.note(self.name, "let go", arc=hold.arc, epoch=hold.epoch)
        try:
            await super().make_safe(hold)
        except HardwareFault as fault:
            self._audit.note(self.name, "unsafe", arc=hold.arc, epoch=hold.epoch, fault=fault.detail)
            raise
        self._audit.note(self.name, "safe", arc=hold.arc, epoch=hold.epoch)


class AuditedScout(AuditedRc[RobotParameters], Scout):
    """A Scout."""


class AuditedCommandRadio(AuditedRc[RcParameters], CommandRadio):
    """A command radio."""


class AuditedVideoFrequency(AuditedRc[RcParameters], VideoFrequency):
    """A video frequency."""


class AuditedFramegrabber(AuditedRc[FramegrabberParameters], Framegrabber):
    """A framegrabber."""

    def absences(self) -> list[Absence]:
        """Return nothing: its receiver takes no pictures."""
        return []


class AuditedGate(Gate):
    """Records when it opens and when it shuts."""

    __slots__ = ("audit",)

    def __init__(self, arc: str, audit: Audit) -> None:
        super().__init__(arc)
        self.audit = audit

    def prepare(self, epochs: Mapping[str, int]) -> None:
        """See ``Gate.prepare``."""
        self._note_shut("connected anew", "")
        super().prepare(epochs)

    def open(self, epochs: Mapping[str, int], now_s: float) -> bool:
        """See ``Gate.open``."""
        opened = super().open(epochs, now_s)
        if opened:
            self.audit.note(self.arc, "open", epochs=dict(epochs))
        return opened

    def close(self, reason: str, by: str, expected_s: float) -> bool:
        """See ``Gate.close``."""
        self._note_shut(reason, by)
        return super().close(reason, by, expected_s)

    def _note_shut(self, reason: str, by: str) -> None:
        if self.is_open:
            self.audit.note(self.arc, "shut", reason=reason, by=by)


class AuditedArc(AggregateResourceController):
    """An ARC with an audited gate."""

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._gate = AuditedGate(self.name, current_audit.get())


class AuditedDriveArc(AuditedArc, DriveArc):
    """ARC kind 1."""


class AuditedVideoDriveArc(AuditedArc, VideoDriveArc):
    """ARC kind 2."""


class AuditedCaptureArc(AuditedArc, CaptureArc):
    """ARC kind 3."""


class AuditedRcManager(RcManager):
    """Records each of its decisions, and checks the invariants of its schedule after each."""

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._audit = current_audit.get()

    def happened(self, event: Event, at_s: float | None = None) -> None:
        """Decide about the event, then check; see ``RcManager.happened``."""
        super().happened(event, at_s)
        try:
            self.manager.check()
        except AssertionError as broken:
            self._audit.note(self.name, "promise broken", promise=str(broken))

    def publish_news(self) -> None:
        """Work the schedule out also if no component hears it, so that a bug in it is found; see ``RcManager``."""
        self.answers.schedule(self.clock.now_s())
        super().publish_news()

    def _carry_out(self, instruction: Instruction) -> None:
        if isinstance(instruction, Record):
            line = {name: value for name, value in instruction.line.items() if name not in {"ev", "t"}}
            self._audit.note(self.name, str(instruction.line["ev"]), **line)
        super()._carry_out(instruction)
