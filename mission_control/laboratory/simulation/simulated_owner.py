"""A decision process with random moods: it drives, idles, requests other run times, releases, claims again.

It uses its ARC through ``arc_client`` as every behavior and console does, and records notices and outcomes of commands
in the audit.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from random import Random

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component.messages import Absence
from backbone.errors import LinkError, Refusal, code_of
from backbone.scheduling.requests import PathNode
from backbone.waiting import end_tasks
from backbone.wire import Envelope, Message
from mission_control.laboratory.simulation.audit import current_audit
from mission_control.laboratory.simulation.shape import OwnerShape
from resource_pool.arc_client import (
    ArcClient,
    ArcNotice,
    NotMyArc,
    Resumed,
    Suspended,
    Suspending,
    arc_name,
    claim_parameters,
    notice_arc,
)
from resource_pool.messages import Applied

log = logging.getLogger(__name__)

TICK_S = 1e-6  # chosen: far above the rounding of times, far below every meaningful time
AGAIN_S = 0.3  # chosen: an unconfirmed wish is repeated about as fast as a person would
TOP_WHEEL_SPEED_RAD_S = 10.0  # chosen: below the motor's limit


class OwnerParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Parameters of a simulated owner.

    Attributes:
        seed: Seed of its moods.
        calm_at_s: Mission time from which the owner only drives.
    """

    seed: int
    shape: OwnerShape
    calm_at_s: float


class SimulatedOwner(Component[OwnerParameters]):
    """Owner of one ARC."""

    parameters_type = OwnerParameters
    accepts = ArcNotice

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._audit = current_audit.get()
        # A restarted owner begins at another time and must have other moods.
        self._dice = Random(f"{self.parameters.seed} {self.name} {clock.now_s():.6f}")
        self._driving_dice = Random(f"driving {self.parameters.seed} {self.name} {clock.now_s():.6f}")
        self._arc: ArcClient | None = None

    async def serve(self) -> None:
        """Claim, use and release the ARC repeatedly; in the calm keep the ARC and drive, or rest."""
        await self.clock.sleep_until_s(self.parameters.shape.begins_s)
        while not self._is_calm():
            await self._live_with_arc()
            await self._until_calm_or(self._dice.uniform(0.1, 3.0))
        if not self.parameters.shape.rests:
            await self._live_with_arc()

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Pass a notice to the ARC client."""
        notice = asked.body
        if not isinstance(notice, ArcNotice):
            return await super().answer(asked)
        if self._arc is None:
            raise NotMyArc(f"{self.name} claims nothing", arc=notice_arc(notice))
        return await self._arc.answer(asked)

    def absences(self) -> list[Absence]:
        """Return the ARC if it is wanted and missing."""
        absence = self._arc.wish.absence() if self._arc is not None else None
        return [absence] if absence is not None else []

    async def arc_resumed(self, notice: Resumed) -> None:
        """Record the grant."""
        self._audit.note(self.name, "resumed", arc=notice.arc, epochs=dict(notice.epochs))

    async def arc_suspending(self, notice: Suspending) -> None:
        """Stop the wheels, as a decision process should."""
        self._audit.note(self.name, "suspending", arc=notice.arc, by=notice.by)
        if self._arc is not None and self._dice.random() < 0.7:
            await self._command("halt", self._arc.halt())

    async def arc_suspended(self, notice: Suspended) -> None:
        """Record the end of the grant."""
        self._audit.note(self.name, "suspended", arc=notice.arc, reason=notice.reason, by=notice.by)

    async def _live_with_arc(self) -> None:
        arc = self._arc = ArcClient(self.bus, arc_name(self.bus, self.parameters.shape.kind), self)
        self._audit.note(self.name, "claims", arc=arc.arc)
        keeping = asyncio.create_task(self._keep(arc), name=f"{self.name}:keep")
        driving = asyncio.create_task(self._drive(arc), name=f"{self.name}:drive")
        try:
            await self._have_moods(arc)
        finally:
            await end_tasks(keeping, driving)
        # From here on the grant is not used, even if notices about it still arrive.
        self._audit.note(self.name, "releases", arc=arc.arc)
        self._arc = None
        self.changed()
        await self._until_said(lambda: arc.release("had enough"))

    async def _have_moods(self, arc: ArcClient) -> None:
        """Change the requests until the ARC is released; in the calm want time and never release."""
        dice, given = self._dice, self.parameters.shape
        while not self._is_calm():
            await self._until_calm_or(dice.uniform(0.2, 2.5))
            mood = dice.choice(("idle", "want", "want", "runtime", "longer", "nothing", "nothing", "release"))
            if self._is_calm():
                break
            match mood:
                case "idle" | "want":
                    await self._say(mood, arc.idle(mood == "idle"))
                case "runtime":
                    least_s = round(dice.uniform(0.5, 1.0) * given.minimum_runtime_s, 3)
                    await self._say(mood, arc.want_runtime(least_s, given.maximum_runtime_s))
                case "longer":
                    await self._say(mood, arc.want_longer(self.clock.now_s() + given.maximum_runtime_s))
                case "release":
                    return
        if given.rests:
            return
        await self._until_said(lambda: arc.idle(False))
        self._audit.note(self.name, "wants", arc=arc.arc)
        await asyncio.Event().wait()

    async def _keep(self, arc: ArcClient) -> None:
        given = self.parameters.shape
        parameters = claim_parameters(
            self.address,
            path=[PathNode(name, priority) for name, priority in given.path],
            minimum_runtime_s=given.minimum_runtime_s,
            maximum_runtime_s=given.maximum_runtime_s,
            wish=given.wish,
            usage=given.usage,
            console=given.console,
        )
        while True:
            try:
                await arc.keep(self.clock, given.kind, parameters, on_changed=self.changed)
            except Refusal as refusal:
                self._audit.note(self.name, "claim refused", arc=arc.arc, code=code_of(refusal))
            await self.clock.sleep_s(AGAIN_S)

    async def _drive(self, arc: ArcClient) -> None:
        dice = self._driving_dice
        while True:
            await arc.wait_granted()
            what = dice.choice(("drive", "drive", "drive", "drive", "drive", "halt", "jump"))
            match what:
                case "halt":
                    await self._command(what, arc.halt())
                case "jump":
                    await self._command(what, arc.jump())
                case _:
                    await self._command(what, arc.drive(self._speed_rad_s(), self._speed_rad_s()))
            await self.clock.sleep_s(dice.uniform(0.1, 0.6))

    def _speed_rad_s(self) -> float:
        return round(self._driving_dice.uniform(-1.0, 1.0) * TOP_WHEEL_SPEED_RAD_S, 2)

    async def _command(self, what: str, doing: Awaitable[Applied]) -> None:
        try:
            applied = await doing
        except Refusal as refusal:
            self._audit.note(self.name, "refused", command=what, code=code_of(refusal))
        except LinkError:
            self._audit.note(self.name, "unanswered", command=what)
        else:
            self._audit.note(self.name, "applied", command=what, rc=applied.rc, epoch=applied.epoch)

    async def _say(self, what: str, saying: Awaitable[None]) -> bool:
        try:
            await saying
        except (Refusal, LinkError) as error:
            log.info("%s: %s: %s", self.name, what, error)
            return False
        self._audit.note(self.name, what)
        return True

    async def _until_said(self, say: Callable[[], Awaitable[None]]) -> None:
        """Repeat a wish until the ARC confirms it, because the outcome of an unanswered wish is unknown."""
        while not await self._say("confirmed", say()):
            await self.clock.sleep_s(AGAIN_S)

    def _is_calm(self) -> bool:
        return self.clock.now_s() >= self.parameters.calm_at_s - TICK_S

    async def _until_calm_or(self, pause_s: float) -> None:
        await self.clock.sleep_until_s(min(self.clock.now_s() + pause_s, self.parameters.calm_at_s))
