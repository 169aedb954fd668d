"""A console's claim on an ARC, for the robot in the console's parameters, from claim to release.

The console claims as a behavior does, with its own priority beside the mission's. A released ARC can rest until the
next claim. ``controls`` sends the commands to the robot.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable

import msgspec

from backbone.bus.interface import Subscription
from backbone.component.messages import LifeState, LogLevel
from backbone.errors import LinkError, Refusal, code_of
from backbone.mission_log.operators import OperatorAction
from backbone.naming import IllegalName
from backbone.wire import Envelope, Message
from resource_pool.arc_client import (
    ArcClient,
    AskBeat,
    Frame,
    NotMyArc,
    Resumed,
    StopState,
    Suspended,
    Suspending,
)
from ui_console.model import events
from ui_console.model.driving import HaltWish
from ui_console.session.claim import ANY_ROBOT, TeleoperationParameters
from ui_console.session.controls import Controls
from ui_console.session.kind_finder import KindFinder
from ui_console.session.observer import Observer
from ui_console.session.stop_ear import StopEar

log = logging.getLogger(__name__)


class ArcClaim:
    """Claims at most one ARC at a time, keeps it while it waits and works, and releases it.

    Args:
        console: Its parameters name robot and kind of ARC.
        controls: Act on the ARC while it is claimed.
        see: Called with the newest picture; None: no pictures are needed.
        keeps_arc: True: a released ARC rests.
        shows_stops: True: show stops of the held robot; False if the console watches all robots.
        taken: Called with the robot at each grant.
    """

    def __init__(
        self,
        console: Observer[TeleoperationParameters],
        controls: Controls,
        *,
        see: Callable[[Frame], None] | None,
        keeps_arc: bool,
        shows_stops: bool,
        taken: Callable[[str], None],
    ) -> None:
        self._console, self._controls, self._taken = console, controls, taken
        self._see, self._keeps_arc, self._shows_stops = see, keeps_arc, shows_stops
        self._arc: ArcClient | None = None
        self._last: tuple[str, dict[str, object]] | None = None
        self._keeping: asyncio.Task[None] | None = None
        self._frames: Subscription | None = None
        self._giving_back, self._releases, self._takes_next = asyncio.Lock(), 0, False
        self._decided = asyncio.Event()
        self._grants = 0
        self._kinds = KindFinder(console, controls.know)
        self._ear = StopEar(console, self._heard_stop)
        self.rests = False
        """True while the ARC rests."""
        self.is_asking = False
        """True from the claim to the release."""
        self.asked_s = 0.0
        """Mission time of the claim."""
        self.holding = ""
        """The robot of the last grant; empty after its release."""
        self.refusal: Refusal | None = None
        """Why the claim was refused; None if it was not."""
        self.given_back: bool | None = None
        """Whether the last release was confirmed; None before one."""

    @property
    def is_held(self) -> bool:
        """True while commands pass."""
        return self._keeping is not None and self._arc is not None and self._arc.granted is not None

    @property
    def is_waiting(self) -> bool:
        """True while the ARC is kept without a grant."""
        return self._keeping is not None and not self.is_held

    def take(self) -> None:
        """Claim the robot unless it is claimed; if releases are in progress, claim it right after the last one."""
        if self._releases:
            self._takes_next = True
            self._decided.clear()
            return
        if self.is_asking:
            return
        if not self._console.parameters.kind:
            if not self._kinds.is_finding:
                self._decided.clear()
                self._kinds.begin(self._console.parameters, self._kind_found, self._claim_refused)
            return
        self._claim(self._console.parameters)

    def _claim(self, wished: TeleoperationParameters) -> None:
        console, rested = self._console, self._arc
        claim = (wished.kind, wished.claim(console.address))
        self.rests = self.rests and self._last == claim
        if not self.rests:
            try:
                self._arc = ArcClient(console.bus, wished.arc(console.bus), self)
            except IllegalName as refusal:  # of a long name and a long kind
                self._claim_refused(refusal)
                return
        arc, self._last, self.is_asking = self._arc, claim, True
        assert arc is not None  # noqa: S101  a resting ARC exists
        self._controls.connect(arc)
        self._ear.close()  # this ARC does not know the state reported to the last one
        if wished.robot:
            console.start_task(self._ear.listen(wished.robot), "stop")
        if self._see is not None:
            self._frames = arc.frames(self._saw)
        self.asked_s, self._grants, self.refusal = console.clock.now_s(), 0, None
        self._decided.clear()
        console.acted(OperatorAction.TAKE, wished.robot or ANY_ROBOT, f"with priority {wished.priority}")
        console.show(events.Asked(self.asked_s, wished.robot, wished.kind, wished.priority))
        self._kinds.take(wished.kind)
        self._keeping = console.start_task(self._keep(arc, claim, rested), "arc")

    async def wait_granted(self) -> None:
        """Wait until the claim is granted.

        Raises:
            Refusal: The claim was refused.
        """
        await self._decided.wait()
        if self.refusal is not None:
            raise self.refusal

    async def _keep(self, arc: ArcClient, claim: tuple[str, dict[str, object]], rested: ArcClient | None) -> None:
        """Keep the claimed ARC; first end a resting ARC that cannot be used any more."""
        kind, parameters = claim
        rests, self.rests = self.rests, False
        try:
            if rested is not None and not rests:
                await _end(rested, "asks otherwise")
            await arc.keep(self._console.clock, kind, parameters, rests=rests)
        except Refusal as refusal:
            self._controls.disconnect()
            self._arc, self._keeping, self.is_asking = None, None, False
            self._hear_no_more()
            self._claim_refused(refusal)

    def _kind_found(self, wished: TeleoperationParameters, kind: str) -> None:
        if self._console.parameters == wished:
            self._console.parameters = msgspec.structs.replace(wished, kind=kind)
        self.take()  # if the parameters changed meanwhile, the kind is sought for the new ones

    def _claim_refused(self, refusal: Refusal) -> None:
        self.refusal, now_s = refusal, self._console.clock.now_s()
        self._console.show(events.CommandRefused(now_s, code_of(refusal), refusal.detail, refusal.remedy, True))
        self._decided.set()

    async def give_back(
        self, reason: str, *, for_good: bool = False, wanted: bool = True, to_order: bool = False
    ) -> None:
        """Release the robot; afterwards no ARC is claimed until the next ``take``.

        Args:
            reason: For people.
            for_good: End the ARC even if it could rest.
            wanted: False if the operator did not request the release.
            to_order: True: an order of this operator gets the robot, so questions of others for it stay open.
        """
        self._takes_next = False  # this release is newer than a claim that waits
        self._releases += 1
        try:
            async with self._giving_back:
                self._kinds.cancel()
                if self._arc is not None and (self.is_asking or for_good):
                    was_asking = self.is_asking
                    await self._give_back(self._arc, reason, for_good=for_good, wanted=wanted)
                    if was_asking and not to_order:
                        self._console.answers.ended(True, reason)
        finally:
            self._releases -= 1
        if self._takes_next and not self._releases and self._console.state is LifeState.READY:
            self._takes_next = False
            self.take()

    async def _give_back(self, arc: ArcClient, reason: str, *, for_good: bool, wanted: bool) -> None:
        keeping, self._keeping = self._keeping, None
        self._controls.switch_off()
        if keeping is not None:
            keeping.cancel()
            await asyncio.wait({keeping})
        confirmed = await self._let_go(arc, reason, for_good=for_good)
        self._hear_no_more()
        if self.is_asking:
            self.is_asking, self.given_back = False, confirmed
            self._record_given_back(reason, confirmed=confirmed, wanted=wanted)

    async def _let_go(self, arc: ArcClient, reason: str, *, for_good: bool) -> bool:
        """Let the ARC rest if the console keeps it, else end it; return whether the ARC confirmed that."""
        if self._keeps_arc and arc.granted is not None and not for_good:  # an ARC that waits could just be granted
            try:
                await arc.rest()
            except (LinkError, Refusal) as error:
                log.info("%s does not rest: %s", arc.arc, error)
            else:
                self.rests = True
                return True
        confirmed = await _end(arc, reason)
        self._controls.disconnect()
        self._arc, self.rests = None, False
        return confirmed

    def _hear_no_more(self) -> None:
        self._ear.close()
        if self._frames is not None:
            self._frames.close()
            self._frames = None

    def _record_given_back(self, reason: str, *, confirmed: bool, wanted: bool) -> None:
        console = self._console
        self._controls.record_drive_end(self.holding, reason)
        robot, self.holding = self.holding or console.parameters.robot or ANY_ROBOT, ""
        console.acted(
            OperatorAction.RELEASE, robot, f"{reason}{'' if confirmed else ', which its ARC did not confirm'}"
        )
        console.report("holds no robot")
        console.show(events.GivenBack(console.clock.now_s(), reason, confirmed, wanted))

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer a notice of the ARC.

        Raises:
            NotMyArc: No ARC is claimed, or the notice comes from another one.
        """
        if self._arc is None:
            raise NotMyArc(f"{self._console.name} claims no ARC")
        arc, notice = self._arc, asked.body
        noted = await arc.answer(asked)
        if isinstance(notice, AskBeat) and notice.state is not None and notice.state.epochs == arc.epochs != {}:
            self._console.show(events.HoldConfirmed(self._console.clock.now_s()))
        return noted

    async def arc_resumed(self, notice: Resumed) -> None:
        """Show the grant; see ``ArcListener``."""
        if self._keeping is None:
            log.info("%s was granted after it was given back", notice.arc)
            return  # the RC manager granted before it received the withdrawal; it will revoke the RCs
        robot, console = notice.robot or "no robot", self._console
        self._controls.require_let_go()
        await self._ear.listen(robot)
        if not self.is_held or self._arc is None or self._arc.epochs != notice.epochs:
            return  # the ARC lost the grant meanwhile
        again, self._grants = self._grants > 0, self._grants + 1
        console.report(f"drives {robot}")
        if not again:
            console.publish_event(robot, f"was taken over by {console.user}", LogLevel.NOTICE)
        self.holding = robot
        self._taken(robot)
        now_s, epochs = console.clock.now_s(), notice.epochs
        console.show(events.Granted(now_s, robot, notice.rcs, epochs, notice.until_s, self.asked_s, again))
        self._decided.set()

    async def arc_suspending(self, notice: Suspending) -> None:  # noqa: ARG002  one command needs no deadline
        """Stop the wheels within the deadline; see ``ArcListener``."""
        if not self.rests:
            await self._controls.do(HaltWish())

    async def arc_suspended(self, notice: Suspended) -> None:
        """Show the loss; see ``ArcListener``."""
        self._controls.require_let_go()
        if self._keeping is not None:
            because = f"{notice.reason} by {notice.by}" if notice.by else notice.reason
            self._console.answers.ended(False, f"it was lost: {because}")
            self._controls.record_drive_end(self.holding, because)
            self._console.report(f"waits: {because}")
            self._console.show(events.Heard(self._console.clock.now_s(), notice))

    def _heard_stop(self, state: StopState) -> None:
        """Show that the held robot was stopped or may move again; the driver must see that before the next command."""
        if self._arc is not None and self._arc.heard_stop(state):
            self._controls.require_let_go()
        if self._shows_stops and state.number > 0:  # 0: never stopped
            self._console.show(events.Heard(self._console.clock.now_s(), state))

    def _saw(self, frame: Frame) -> None:
        if self._see is not None:
            self._console.show(events.PictureSeen(self._console.clock.now_s(), frame.captured_s, frame.robot))
            self._see(frame)


async def _end(arc: ArcClient, reason: str) -> bool:
    """End the ARC; return whether that was confirmed."""
    try:
        await arc.release(reason)
    except LinkError as error:
        log.info("the release of %s was not confirmed: %s", arc.arc, error)
        return False
    return True
