"""Teleoperation: a person's hold on one robot.

The console claims an ARC as a behavior does, with a priority of its own beside the mission's, and gives it back on
request, at its end, or by its death, which the ARC sees. Faces (terminal, script) receive events through ``show`` and
pictures through ``see``, and call the verbs. Commands go through ``controls``, the operators' questions about the robot
through ``consent_talk``, orders to robots through ``order_keeper``.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Sequence
from typing import ClassVar

import msgspec

from backbone.bus.interface import Bus, Clock, Subscription
from backbone.component.launch import Launch
from backbone.component.messages import LifeState, LogLevel
from backbone.errors import LinkError, Refusal, code_of
from backbone.mission.behavior_reports import ChildReport
from backbone.mission_log.operators import OperatorAction
from backbone.wire import Accepts, Envelope, Message
from resource_pool.arc_client import ArcClient, ArcNotice, Frame, NotMyArc, Resumed, StopState, Suspended, Suspending
from ui_console.model import events
from ui_console.model.arc_abilities import ArcAbilities
from ui_console.model.consent import AskConsent, Consent
from ui_console.model.driving import Command, GiveWish, HaltWish, Motion
from ui_console.model.lifting import AskLift
from ui_console.model.orders import Order
from ui_console.session.claim import ANY_ROBOT, TeleoperationParameters
from ui_console.session.consent_answers import ConsentAnswers
from ui_console.session.consent_talk import Claim, ConsentTalk
from ui_console.session.controls import Controls
from ui_console.session.hand_over import AskHandOver, HandOver
from ui_console.session.kind_finder import KindFinder
from ui_console.session.order_keeper import OrderKeeper
from ui_console.session.order_verbs import OrderVerbs
from ui_console.session.presence import OperatorPresence
from ui_console.session.stop_ear import StopEar
from ui_console.session.waiting import Waiting

log = logging.getLogger(__name__)


class Teleoperation(OrderVerbs):
    """One console.

    Args:
        show: Called with each event, in order.
        see: Called with the newest picture; pictures of earlier grants never arrive.
        work: Run once the console is ready, instead of a wait for a request to end; its end ends the console.
        takes: Claim at once.
        orders: Orders to give at once, with the stick at the robot of the parameters.
        watches: Also show events of other components.
        keeps_arc: Keep the ARC when the robot is given back, so that the next take needs no start of an ARC.
        signs_in: Publish that its operator came and left; False if another component does.
        user: The driver, for the record; empty: the console's name.
        answers: The questions to its operator, if several consoles are one person's; None: new ones.
    """

    parameters_type: ClassVar[type[msgspec.Struct]] = TeleoperationParameters
    accepts: ClassVar[Accepts | None] = ArcNotice | AskConsent | AskHandOver | AskLift | ChildReport

    def __init__(
        self,
        launch: Launch,
        bus: Bus,
        clock: Clock,
        *,
        show: Callable[[events.ConsoleEvent], None],
        see: Callable[[Frame], None] | None = None,
        work: Callable[[Teleoperation], Awaitable[None]] | None = None,
        takes: bool = True,
        orders: Sequence[Order] = (),
        watches: bool = True,
        keeps_arc: bool = False,
        signs_in: bool = True,
        user: str = "",
        answers: ConsentAnswers | None = None,
    ) -> None:
        super().__init__(launch, bus, clock, show=show, watches=watches, signs_in=signs_in, user=user, answers=answers)
        self._see, self._work, self._takes, self._keeps_arc = see, work, takes, keeps_arc
        self._first_orders = orders
        self._arc: ArcClient | None = None
        self._claimed: tuple[str, dict[str, object]] | None = None
        self._rests = False
        self._keeping: asyncio.Task[None] | None = None
        self._frames: Subscription | None = None
        self._giving_back = asyncio.Lock()
        self._is_asking = self._takes_next = False
        self._asked_s = 0.0
        self._grants = 0
        self._kind = self.parameters.kind
        self._decided = asyncio.Event()
        self._controls = Controls(self)
        self._kinds = KindFinder(self, self._controls.know)
        self._consent = ConsentTalk(self, self.give_back)
        self._hand_over = HandOver(self, self.give_back)
        self._waiting = Waiting(self, self._hand_over, self._waits_for)
        self._ear = StopEar(self, self._heard_stop)
        self._presence = OperatorPresence(self)
        self._orders = OrderKeeper(self, lambda: self._robot, self._hand_to_order, self._take_back)
        self._holding = ""
        self._next = ("", "")
        self._switching = asyncio.Lock()
        self.refusal: Refusal | None = None
        """Why the claim was refused; None if it was not."""
        self.given_back: bool | None = None
        """Whether the last release was confirmed; None before one."""

    # ------------------------------------------------------------------ verbs
    @property
    def is_held(self) -> bool:
        """True while commands pass."""
        return self._keeping is not None and self._arc is not None and self._arc.granted is not None

    @property
    def arc_abilities(self) -> ArcAbilities | None:
        """What the operator can do with the ARC; None: not known."""
        return self._controls.abilities

    @property
    def is_ready(self) -> bool:
        """True while verbs can be called."""
        return self.state is LifeState.READY

    def take(self) -> None:
        """Claim the robot unless it is claimed; if its release is under way, right afterwards; its order ends."""
        if not self._orders.touched(self._robot):
            self._take()

    def _take(self) -> None:
        if self._giving_back.locked():
            self._takes_next = True
            self._decided.clear()
            return
        if self._is_asking:
            return
        if not self.parameters.kind:
            if not self._kinds.is_finding:
                self._decided.clear()
                self._kinds.begin(self.parameters, self._kind_found, self._claim_refused)
            return
        wished, rested = self.parameters, self._arc
        claim = (wished.kind, wished.claim(self.address))
        self._rests = self._rests and self._claimed == claim
        if not self._rests:
            self._arc = ArcClient(self.bus, wished.arc(self.bus), self)
        arc, self._claimed, self._is_asking = self._arc, claim, True
        assert arc is not None  # noqa: S101  an ARC that rests exists
        self._controls.connect(arc)
        self._ear.close()  # the state it reported to the last ARC is new to this one
        if wished.robot:
            self.start_task(self._ear.listen(wished.robot), "stop")
        if self._see is not None:
            self._frames = arc.frames(self._saw)
        self._asked_s, self._grants, self.refusal = self.clock.now_s(), 0, None
        self._decided.clear()
        self.acted(OperatorAction.TAKE, wished.robot or ANY_ROBOT, f"with priority {wished.priority}")
        self.show(events.Asked(self._asked_s, wished.robot, wished.kind, wished.priority))
        self._kinds.take(wished.kind)
        self._keeping = self.start_task(self._keep(arc, rested), "arc")

    async def switch(self, robot: str, kind: str = "") -> None:
        """Claim another robot in place of the present one, which is stopped and given back first.

        An order of the present robot goes on, and so does one of the other robot: then the stick only turns to it. The
        present robot stays with the stick until the behavior of its order can have it.
        After several calls in a row the console claims the last robot.

        Args:
            robot: Its name.
            kind: Component type of the ARC; another one than now also gives the robot back and claims it anew. Empty:
                that of now for the same robot, else that of the console's parameters.
        """
        wished = self._next = (robot, kind)
        async with self._switching:
            await self._orders.wait_begun(self._robot)
            if wished != self._next:
                return
            now = self.parameters
            if robot != now.robot or kind not in ("", now.kind):
                self.parameters = msgspec.structs.replace(now, robot=robot, kind=kind or self._kind)
                await self._give_back_stick(f"{self.user} takes {robot}", for_good=True)
            if self._orders.goes_on(robot):
                self.show(events.TurnedTo(self.clock.now_s(), robot))
            else:
                self.take()

    def touch(self) -> None:
        """Note that the operator is there; driving shows that by itself."""
        self._presence.touch()

    def leave(self) -> None:
        """Stop the wheels and ignore held controls: the operator turned away, or the window is no longer in front."""
        self._presence.leave()
        self.require_let_go()

    def require_let_go(self) -> None:
        """Stop the wheels; a control that is held moves nothing until it was let go and pressed anew.

        When: a dialog opens or closes. Stops, lifts, grants, and the loss of robot or link require it anyway.
        """
        self._controls.require_let_go()

    async def wait_granted(self) -> None:
        """Return when the claim was granted.

        Raises:
            Refusal: The claim was refused.
        """
        await self._decided.wait()
        if self.refusal is not None:
            raise self.refusal

    def hold(self, drive: Motion, lasts_s: float | None = None) -> None:
        """Take in that a drive key is down: the command repeats until the hold ends, then the wheels stop.

        Args:
            drive: The command of the key.
            lasts_s: How long the press counts, machine seconds, for a control that repeats while held; None: as keys.
        """
        self.touch()
        if self._controls.hold(drive, lasts_s):
            self.interrupt()

    def stop(self) -> None:
        """Stop the wheels now; sticks, pads and pages report their release by this call."""
        self._controls.stop()

    def give(self, wish: GiveWish) -> None:
        """Take in that the control for one command is pressed: give it, unless the control has to be let go first."""
        self.touch()
        if self._controls.press_once(wish.word):
            self.interrupt()
            if self.is_held:
                self.start_task(self._give(wish), "command")

    async def do(self, command: Command) -> bool:
        """Send one command and show its outcome; return True if it was applied."""
        return not self._rests and await self._controls.do(command)

    def begin_release(self) -> None:
        """Give the robot back without waiting for it."""
        self.start_task(self.give_back(), "release")

    async def give_back(self, reason: str = "released", *, for_good: bool = False, wanted: bool = True) -> None:
        """Give the robot back, also from an order, which ends; afterwards the console watches until the next ``take``.

        Args:
            reason: For people.
            for_good: End the ARC also if the console keeps it otherwise.
            wanted: False if the operator did not ask for it.
        """
        robot, had_stick = self._robot, self._is_asking
        had_order = await self._orders.give_back(robot, reason)
        await self._give_back_stick(reason, for_good=for_good, wanted=wanted)
        if had_order and not had_stick:
            self.given_back = True
            self.acted(OperatorAction.RELEASE, robot, reason)
            self.show(events.GivenBack(self.clock.now_s(), reason, True, wanted))

    async def _give_back_stick(self, reason: str, *, for_good: bool = False, wanted: bool = True) -> None:
        async with self._giving_back:
            self._kinds.cancel()
            if self._arc is not None and (self._is_asking or for_good):
                await self._give_back(self._arc, reason, for_good=for_good, wanted=wanted)
        if self._takes_next and self.is_ready:
            self._takes_next = False
            self._take()

    async def _hand_to_order(self, robot: str, order: str) -> None:
        """Give the robot from the stick to its order, which waits for it: no lower ARC gets it in between."""
        if robot == self._robot and self._is_asking:
            self.parameters = msgspec.structs.replace(self.parameters, robot=robot)
            await self._give_back_stick(f"ordered: {order}")

    def _take_back(self, robot: str) -> None:
        """Claim the robot by the stick, which goes before its order."""
        if robot != self._robot:
            return
        if self.is_held and self._holding == robot:
            self._orders.taken(robot)
        else:
            self.parameters = msgspec.structs.replace(self.parameters, robot=robot)
            self._take()

    @property
    def _robot(self) -> str:
        return self.parameters.robot or self._holding

    async def _give_back(self, arc: ArcClient, reason: str, *, for_good: bool, wanted: bool) -> None:
        keeping, self._keeping = self._keeping, None
        self._controls.switch_off()
        if keeping is not None:
            keeping.cancel()
            await asyncio.wait({keeping})
        confirmed = await self._let_go(arc, reason, for_good=for_good)
        if self._frames is not None:
            self._frames.close()
            self._frames = None
        if self._is_asking:
            self._is_asking, self.given_back = False, confirmed
            self._record_given_back(reason, confirmed=confirmed, wanted=wanted)

    async def _let_go(self, arc: ArcClient, reason: str, *, for_good: bool) -> bool:
        """Rest the ARC if the console keeps it, else end it; return whether the ARC confirmed that."""
        if self._keeps_arc and arc.granted is not None and not for_good:  # an ARC that waits could just be granted
            try:
                await arc.rest()
            except (LinkError, Refusal) as error:
                log.info("%s does not rest: %s", arc.arc, error)
            else:
                self._rests = True
                return True
        confirmed = True
        try:
            await arc.release(reason)
        except LinkError as error:
            log.info("the release was not confirmed: %s", error)
            confirmed = False
        self._controls.disconnect()
        self._arc, self._rests = None, False
        return confirmed

    def _record_given_back(self, reason: str, *, confirmed: bool, wanted: bool) -> None:
        self._ear.close()
        self._controls.record_drive_end(self._holding, reason)
        self.answers.ended(True, reason)
        robot, self._holding = self._holding or self.parameters.robot or ANY_ROBOT, ""
        self.acted(OperatorAction.RELEASE, robot, f"{reason}{'' if confirmed else ', which its ARC did not confirm'}")
        self.report("holds no robot")
        self.show(events.GivenBack(self.clock.now_s(), reason, confirmed, wanted))

    # ------------------------------------------------------------------ consent
    def begin_ask_consent(self, why: str = "") -> None:
        """Ask the consoles that hold the robot, and show their answers; do nothing while such a question is open."""
        robot, is_waiting = self.parameters.robot, self._is_asking and not self.is_held
        claim = Claim(self.parameters.arc(self.bus), robot, robot or ANY_ROBOT, self._asked_s)
        self._consent.begin_ask(claim if is_waiting else None, why)

    def _consent_at_once(self) -> Consent | None:
        """Return the answer to a question for the robot if it needs no decision; None: the operator decides."""
        if not self.is_held:
            return Consent(not self._is_asking, self.user, "holds nothing")
        return Consent(False, self.user, "a script drives") if self._work is not None else None

    # ------------------------------------------------------------------ the component's hooks
    async def serve(self) -> None:
        """Claim, then listen; the keys have a task of their own."""
        self.sign_in(f"to drive {self.parameters.robot or ANY_ROBOT}, with priority {self.parameters.priority}")
        if self._takes:
            self.take()
        if self._first_orders:
            self.show(events.TurnedTo(self.clock.now_s(), self.parameters.robot))
            self.order_group(self._first_orders)
        self.start_task(self._controls.run(), "keys")
        if self.parameters.away_after_s > 0:
            self.start_task(self._presence.run(self.parameters.away_after_s, self._go_away), "presence")
        if self._work is not None:
            self.start_task(self._work_and_end(self._work), "work")
        await self.watch()

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer the ARC's notices, and other consoles that ask for the robot or to lift a stop."""
        if isinstance(asked.body, AskConsent):
            return await self._consent.seek(asked.source, asked.body, self._consent_at_once())
        if isinstance(asked.body, AskHandOver):
            holds, by_script = self._holding if self.is_held else "", self._work is not None
            return await self._hand_over.answer(asked.body, holds, self._asked_s, by_script=by_script)
        if isinstance(asked.body, AskLift) and self._work is not None:
            stopped_it = asked.body.console == self.address
            return Consent(False, self.user, "a script drives, and stopped it", is_here=stopped_it)
        if isinstance(asked.body, ChildReport):
            return self._orders.reported(asked.source, asked.body)
        if not isinstance(asked.body, ArcNotice):
            return await super().answer(asked)
        if self._arc is None:
            raise NotMyArc(f"{self.name} claims no ARC")
        return await self._arc.handle(asked.body)

    async def drain(self) -> None:
        """Give the robots back if they were not."""
        await asyncio.gather(self._orders.drain(), self._give_back_stick("the console ends", for_good=True))
        await super().drain()

    async def connect(self) -> None:
        """Subscribe to the mission's messages, and to this console's link."""
        await super().connect()
        self.bus.watch_link(lambda _is_up: self.require_let_go())

    def schedule_heard(self) -> None:
        """Ask why this console waits, if it does."""
        self._waiting.ask(self.parameters.arc(self.bus))

    def _waits_for(self) -> tuple[str, float] | None:
        is_waiting = self._keeping is not None and not self.is_held
        return (self.parameters.robot, self._asked_s) if is_waiting else None

    # ------------------------------------------------------------------ the ARC
    async def arc_resumed(self, notice: Resumed) -> None:
        """Show the grant; see ``ArcListener``."""
        if self._keeping is None:
            log.info("%s was granted after it was given back", notice.arc)
            return  # the RC manager granted before it got the withdrawal; it revokes the RCs then
        robot = notice.robot or "no robot"
        self.require_let_go()
        await self._ear.listen(robot)
        if not self.is_held or self._arc is None or self._arc.epochs != notice.epochs:
            return  # the ARC lost it again meanwhile
        again, self._grants = self._grants > 0, self._grants + 1
        self.report(f"drives {robot}")
        if not again:
            self.publish_event(robot, f"was taken over by {self.user}", LogLevel.NOTICE)
        self._holding = robot
        self._orders.taken(robot)
        now_s, epochs = self.clock.now_s(), notice.epochs
        self.show(events.Granted(now_s, robot, notice.rcs, epochs, notice.until_s, self._asked_s, again))
        self._decided.set()

    async def arc_suspending(self, notice: Suspending) -> None:  # noqa: ARG002  one command needs no deadline
        """Stop the wheels within the deadline; see ``ArcListener``."""
        await self.do(HaltWish())

    async def arc_suspended(self, notice: Suspended) -> None:
        """Show the loss; see ``ArcListener``."""
        self.require_let_go()
        if self._keeping is not None:
            because = f"{notice.reason} by {notice.by}" if notice.by else notice.reason
            self.answers.ended(False, f"it was lost: {because}")
            self._controls.record_drive_end(self._holding, because)
            self.report(f"waits: {because}")
            self.show(events.Heard(self.clock.now_s(), notice))

    def _heard_stop(self, state: StopState) -> None:
        """Show that the robot held was stopped or may move again: its driver has to know that first."""
        if self._arc is not None and self._arc.heard_stop(state):
            self.require_let_go()
        if not self._watches and state.number > 0:  # 0: it never was stopped
            self.show(events.Heard(self.clock.now_s(), state))

    def _kind_found(self, wished: TeleoperationParameters, kind: str) -> None:
        if self.parameters == wished:
            self.parameters = msgspec.structs.replace(wished, kind=kind)
            self._take()

    def _claim_refused(self, refusal: Refusal) -> None:
        self.refusal = refusal
        refused = events.CommandRefused(self.clock.now_s(), code_of(refusal), refusal.detail, refusal.remedy, True)
        self.show(refused)
        self._decided.set()

    async def _keep(self, arc: ArcClient, rested: ArcClient | None) -> None:
        """Keep the ARC as it was claimed; first end an ARC that rested and cannot be used any more."""
        assert self._claimed is not None  # noqa: S101  made in take
        kind, parameters = self._claimed
        rests, self._rests = self._rests, False
        try:
            if rested is not None and not rests:
                await rested.release("asks otherwise")
            await arc.keep(self.clock, kind, parameters, rests=rests)
        except Refusal as refusal:
            self._controls.disconnect()
            self._arc, self._keeping, self._is_asking = None, None, False
            self._claim_refused(refusal)

    def _saw(self, frame: Frame) -> None:
        if self._see is not None:
            self.show(events.PictureSeen(self.clock.now_s(), frame.captured_s, frame.robot))
            self._see(frame)

    # ------------------------------------------------------------------ away, and single commands
    async def _go_away(self) -> None:
        """Let the robot go on with useful work while its operator is away."""
        self.leave()
        self._orders.away(f"{self.user} is away")
        await self._give_back_stick(f"{self.user} is away", wanted=False)

    async def _give(self, wish: GiveWish) -> None:
        await self.do(wish)

    async def _work_and_end(self, work: Callable[[Teleoperation], Awaitable[None]]) -> None:
        await work(self)
        self.end("the work is done")
