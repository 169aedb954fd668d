"""Operator: a console of an experiment, which drives one Scout for a while, rests, and drives again.

The operator claims an ARC through ``arc_client``, as every console does, and sends commands in its phases of driving
during grants. It needs no pictures, so it holds a robot and a video frequency, but no framegrabber.

Source: IROS 2001, "Experiments": extra Scouts are teleoperated through consoles that hold no framegrabber.
"""

from __future__ import annotations

import asyncio
from random import Random
from typing import Annotated, ClassVar

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.errors import LinkError, Refusal
from backbone.wire import Accepts, Envelope, Message
from resource_pool.arc_client import (
    ArcClient,
    ArcNotice,
    PathNode,
    Resumed,
    Suspended,
    Suspending,
    Usage,
    arc_name,
    claim_parameters,
)

KIND = "video_drive"
COMMAND_EVERY_S = 0.4  # chosen: shorter than the half second after which a robot stops by itself
TURN_RAD_S = 3.0  # chosen: wheel speed at which a Scout turns on the spot, slowly


class OperatorParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Parameters of ``SimulatedOperator``.

    Attributes:
        robot: Scout to claim.
        priority: Among the consoles and the mission.
        minimum_runtime_s: Shortest useful time, seconds.
        period_s: Interval between radio packets, seconds.
        packet_time_s: Air time of one packet, seconds.
        driven: Share of the time in which the operator drives, 0 to 1.
        drive_s: Mean duration of one phase of driving, seconds.
        yields: True: it requests no time while it does not drive.
        seed: Seed of the phases.
    """

    robot: str
    priority: int
    minimum_runtime_s: float
    period_s: float
    packet_time_s: float
    driven: Annotated[float, msgspec.Meta(ge=0, le=1)] = 1.0
    drive_s: Annotated[float, msgspec.Meta(gt=0)] = 5.0
    yields: bool = False
    seed: int = 0


class DrivePhases:
    """Alternating phases of driving and rest, from a seed; they began in the past, so that all times are equivalent.

    Pure. The phases have exponentially distributed durations, whose means give the wanted share.

    Args:
        driven: Share of the time in which the operator drives.
        drive_s: Mean time of driving, seconds.
    """

    def __init__(self, seed: int, driven: float, drive_s: float) -> None:
        self._dice = Random(f"phases {seed}")
        self._driven, self._drive_s = driven, drive_s
        self.is_driving = self._dice.random() < driven

    def next_change_s(self) -> float:
        """Return the time until the next change of phase; infinite: never. Draws at each call."""
        if self._driven in (0.0, 1.0):
            return float("inf")
        rest_s = self._drive_s * (1 - self._driven) / self._driven
        return self._dice.expovariate(1 / (self._drive_s if self.is_driving else rest_s))

    def change(self) -> None:
        """Change between driving and rest."""
        self.is_driving = not self.is_driving


class SimulatedOperator(Component[OperatorParameters]):
    """A simulated console that drives in some phases."""

    parameters_type = OperatorParameters
    accepts: ClassVar[Accepts | None] = ArcNotice

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        given = self.parameters
        self._phases = DrivePhases(given.seed, given.driven, given.drive_s)
        self._arc = ArcClient(bus, arc_name(bus, KIND), self)
        self._may_drive = asyncio.Event()
        self._applied = self._refused = 0

    async def serve(self) -> None:
        """Claim, then drive and rest."""
        self.start_task(self._drive(), "drive")
        self.start_task(self._change(), "phases")
        given = self.parameters
        parameters = claim_parameters(
            self.address,
            path=[PathNode(self.name, given.priority)],
            minimum_runtime_s=given.minimum_runtime_s,
            wish={"scout": given.robot},
            usage=Usage(given.period_s, given.packet_time_s, kind="drive"),
            console=True,
            idle=self._wants_nothing,
            stops_at_once=True,
        )
        await self._arc.keep(self.clock, KIND, parameters)

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer the ARC's notices."""
        return await self._arc.answer(asked)

    def statistics(self) -> dict[str, float]:
        """Count applied and failed commands."""
        return {"commands_applied": self._applied, "commands_refused": self._refused}

    async def arc_resumed(self, notice: Resumed) -> None:  # noqa: ARG002
        """Drive, in a phase of driving; see ``ArcListener``."""
        self._look()

    async def arc_suspending(self, notice: Suspending) -> None:
        """Do nothing, because the radio's last packet stops the robot; see ``ArcListener``."""

    async def arc_suspended(self, notice: Suspended) -> None:  # noqa: ARG002
        """Stop driving; see ``ArcListener``."""
        self._look()

    @property
    def _wants_nothing(self) -> bool:
        return self.parameters.yields and not self._phases.is_driving

    def _look(self) -> None:
        if self._phases.is_driving and self._arc.granted is not None:
            self._may_drive.set()
        else:
            self._may_drive.clear()

    async def _change(self) -> None:
        while True:
            after_s = self._phases.next_change_s()
            if after_s == float("inf"):
                return
            await self.clock.sleep_s(after_s)
            self._phases.change()
            self._look()
            if self.parameters.yields:
                await self._say_whether_wanted()

    async def _say_whether_wanted(self) -> None:
        try:
            await self._arc.idle(self._wants_nothing)
        except (Refusal, LinkError) as error:  # the next change of phase repeats the wish
            self.story.note(self._arc.arc, f"did not answer whether time is wanted: {error}")

    async def _drive(self) -> None:
        while True:
            await self._may_drive.wait()
            try:
                await self._arc.drive(TURN_RAD_S, -TURN_RAD_S)
                self._applied += 1
            except (Refusal, LinkError):  # the slice ended first
                self._refused += 1
            await self.clock.sleep_s(COMMAND_EVERY_S)
