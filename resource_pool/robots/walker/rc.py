"""RC of a walker: turns requested speeds into joint targets for the radio.

Rules of this file:

* From the first move until the walker stands, the motion control steps at its fixed rate. It waits only for its clock.
  A late step is counted, and continues from the feet's last positions.
* The newest targets are loaded after each step, so that each turn of the radio sends targets that are at most one step
  old. A slow radio sends fewer targets.
* After a halt, or if commands stop, the walker walks to a stand. An emergency stop and the end of the hold end the loop
  at once, and the walker's board puts the legs down.

Source: Petters, Thomas, von Stryk, RoboFrame, 2006, section IV: the MotionControl module.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from backbone.bus.interface import Bus, Clock
from backbone.component.abilities import CameraForm
from backbone.component.launch import Launch
from backbone.errors import LinkError, Refusal
from resource_pool.commands import Command, Halt, Move, SwitchTransmitter
from resource_pool.drivers.interface import MalformedReply
from resource_pool.drivers.simulated import SimulatedRobotProtocol
from resource_pool.holds import Hold
from resource_pool.messages import DEFAULT_DRIVE_USAGE
from resource_pool.rcs.robot import RobotParameters, RobotRc
from resource_pool.robots.walker.gait import MAX_FORWARD_M_S, MAX_TURN_RAD_S, TROT, WALK, TrunkSpeed, clip
from resource_pool.robots.walker.link import Angles, JointTargets, encode_joint_targets
from resource_pool.robots.walker.motion import STEP_S, MotionControl, StateOfMotion
from resource_pool.robots.walker.pace import Pace
from resource_pool.robots.walker.report import WalkerReport, report_of
from scout_model.dimensions import CAMERA_TILT_RAD, HORIZONTAL_VIEW_RAD
from scout_model.errors import MalformedPacket

GAITS = {"trot": TROT, "walk": WALK}
ARRIVE_S = DEFAULT_DRIVE_USAGE.period_s  # the joints arrive when the next packet is due
LASTS_S = 0.2  # chosen: after four packets without newer targets the legs go down, before the walker's own watchdog
STILL = TrunkSpeed()
CAMERA_HEIGHT_M = 0.19  # measured while it stands


class WalkerParameters(RobotParameters, frozen=True, kw_only=True):
    """Parameters of a walker.

    Attributes:
        protocol: Name of the driver that encodes its packets.
        gait: The faster ``trot``, or the steadier ``walk``.
    """

    protocol: str = "resource_pool.robots.walker.rc:WalkerProtocol"
    gait: Literal["trot", "walk"] = "trot"


class WalkerProtocol(SimulatedRobotProtocol):
    """Encodes the walker's packets, and reads its replies."""

    motion: Callable[[], StateOfMotion] | None = None
    """Returns the state of the motion control, for the walker's reports."""

    def joints(self, targets_rad: Angles) -> bytes:
        """Return the packet that brings the joints to these angles by the time of the next packet."""
        return encode_joint_targets(JointTargets(targets_rad, ARRIVE_S))

    def read(self, payload: bytes) -> WalkerReport:
        """Decode the walker's reply; see ``ReplyReader``."""
        if self.motion is None:
            raise MalformedReply("no motion control completes the walker's reply")
        try:
            return report_of(payload, self.motion())
        except MalformedPacket as error:
            raise MalformedReply(str(error)) from error


@dataclass(eq=False, slots=True)
class _Walk:
    """One walk, from rest to rest: its hold and the last order to move."""

    hold: Hold
    order: Move


class WalkerRc(RobotRc[WalkerParameters]):
    """Four legs, twelve servos, and the motion control that moves them."""

    parameters_type = WalkerParameters
    body_class = "resource_pool.robots.walker.body:Walker"
    commands = Move | Halt | SwitchTransmitter
    reports = WalkerReport
    camera = CameraForm(
        forward_m=0.167, height_m=CAMERA_HEIGHT_M, tilt_rad=CAMERA_TILT_RAD, across_rad=HORIZONTAL_VIEW_RAD
    )
    limits: ClassVar[Mapping[str, tuple[float, float]]] = {
        "forward_m_s": (-MAX_FORWARD_M_S, MAX_FORWARD_M_S),
        "turn_rad_s": (-MAX_TURN_RAD_S, MAX_TURN_RAD_S),
    }
    _protocol: WalkerProtocol

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._gait = GAITS[self.parameters.gait]
        self._control, self._pace = MotionControl(self._gait), Pace(STEP_S)
        self._protocol.motion = self._control.state
        self._walk: _Walk | None = None
        self._begun, self._stepped = asyncio.Event(), asyncio.Event()

    async def serve(self) -> None:
        """Also step the motion control while the walker walks."""
        self.start_task(self._step_at_rate(), "motion control")
        self.start_task(self._load_when_stepped(), "joint targets")
        await super().serve()

    async def driver_exchanged(self) -> None:
        """Let the protocol that works now read the state of the motion control."""
        self._protocol.motion = self._control.state

    async def obey(self, hold: Hold, order: Command) -> Mapping[str, float]:
        """Move, halt, or switch the transmitter."""
        if not isinstance(order, Move):
            return await super().obey(hold, order)
        wanted = clip(TrunkSpeed(order.forward_m_s, order.turn_rad_s), self._gait)
        self.watch_silence(is_moving=wanted != STILL)
        if self._walk is not None:
            self._walk.order = order
            self._control.request(wanted)
        elif wanted == STILL:
            await self.halt(hold)
        else:
            self._walk = _Walk(hold, order)
            self._control.request(wanted)
            self._begun.set()
            await self._load_targets(self._walk)  # refused without a radio
        return {"forward_m_s": wanted.forward_m_s, "turn_rad_s": wanted.turn_rad_s}

    async def halt(self, hold: Hold) -> None:
        """Walk to a stand."""
        if self._walk is not None:
            self._control.request(STILL)
        else:
            await super().halt(hold)

    def cease(self) -> None:
        """End the walk between two steps; the walker's board puts the legs down."""
        if self._walk is not None:
            self._walk = None
            self._control.rest()

    def statistics(self) -> dict[str, float]:
        """Also count the motion control's steps and late steps."""
        return {**super().statistics(), **self._pace.statistics()}

    async def _step_at_rate(self) -> None:
        """Make a step every ``STEP_S`` of mission time during a walk."""
        while True:
            if self._walk is None:
                self._begun.clear()
                await self._begun.wait()
                self._pace.begin(self.clock.now_s())
            await self.clock.sleep_until_s(self._pace.due_s)
            if self._walk is not None:
                now_s = self.clock.now_s()
                self._pace.step(now_s)
                self._control.step(now_s)
                self._stepped.set()

    async def _load_when_stepped(self) -> None:
        """Load the newest targets; once the walker stands, end the walk."""
        while True:
            await self._stepped.wait()
            self._stepped.clear()
            if (walk := self._walk) is None:
                continue
            try:
                if self._control.state().is_resting:
                    self.cease()
                    await self._load(walk.hold, self._protocol.halt())
                else:
                    await self._load_targets(walk)
            except (Refusal, LinkError) as error:  # swapped out, stopped, or no radio: the board puts the legs down
                self.story.note(walk.hold.arc, f"its walk ended: {error}")
                if self._walk is walk:
                    self.cease()

    async def _load_targets(self, walk: _Walk) -> None:
        packet, still = self._protocol.joints(self._control.state().joints_rad), self._protocol.halt()
        await self._move(walk.hold, walk.order, packet, lasts_s=LASTS_S, afterwards=still)
