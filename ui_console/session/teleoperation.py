"""Teleoperation: a person holds and drives one robot.

The console claims an ARC by its ``arc_claim``, and releases it on request or at its end; if the console dies, the ARC
detects that. User interfaces (terminal, script) receive events through ``show`` and pictures through ``see``, and call
the methods below "verbs". ``controls`` sends commands, ``consent_talk`` handles operators' questions about the robot,
``order_keeper`` handles orders.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import ClassVar

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.component.messages import LifeState
from backbone.errors import Refusal
from backbone.mission.behavior_reports import ChildReport
from backbone.mission_log.operators import OperatorAction
from backbone.wire import Accepts, Envelope, Message
from resource_pool.arc_client import ArcNotice, Frame
from ui_console.model import events
from ui_console.model.arc_abilities import ArcAbilities
from ui_console.model.consent import AskConsent, Consent, WithdrawConsent
from ui_console.model.driving import Command, GiveWish, Motion
from ui_console.model.lifting import AskLift
from ui_console.model.orders import GivenOrder, Order
from ui_console.session.arc_claim import ArcClaim
from ui_console.session.claim import ANY_ROBOT, TeleoperationParameters
from ui_console.session.consent_answers import ConsentAnswers
from ui_console.session.consent_talk import Claim, ConsentTalk
from ui_console.session.controls import Controls
from ui_console.session.hand_over import AskHandOver, HandOver
from ui_console.session.observer import Observer
from ui_console.session.order_keeper import OrderKeeper
from ui_console.session.presence import OperatorPresence
from ui_console.session.waiting import Waiting

log = logging.getLogger(__name__)


class Teleoperation(Observer[TeleoperationParameters]):
    """A console that drives a robot.

    Args:
        show: Called with each event, in order.
        see: Called with the newest picture; pictures of earlier grants never arrive.
        work: Run when the console is ready, instead of a wait for a request to end; its end ends the console.
        takes: True: claim at once.
        orders: Orders to give at once, with the stick at the robot in the parameters.
        watches: True: also show events of other components.
        keeps_arc: True: keep the ARC when the robot is released, so that the next claim needs no start of an ARC.
        signs_in: True: publish the operator's arrival and departure; False if another component does.
        user: The driver, for the record; empty: the console's name.
        answers: The questions to its operator, if one person has several consoles; None: new ones.
    """

    parameters_type: ClassVar[type[msgspec.Struct]] = TeleoperationParameters
    fixed: ClassVar[frozenset[str]] = frozenset({"robot", "kind", "sight", "away_after_s"})  # read when it begins
    accepts: ClassVar[Accepts | None] = ArcNotice | AskConsent | WithdrawConsent | AskHandOver | AskLift | ChildReport

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
        def seen(event: events.ConsoleEvent) -> None:
            show(event)
            if isinstance(event, events.Granted | events.GivenBack):
                self._consent.withdraw(event.robot if isinstance(event, events.Granted) else "")

        super().__init__(launch, bus, clock, show=seen, watches=watches, signs_in=signs_in, user=user, answers=answers)
        self._work, self._takes, self._first_orders = work, takes, orders
        self._kind = self.parameters.kind
        self._controls = Controls(self)
        self._orders = OrderKeeper(self, lambda: self._robot, self._hand_to_order, self._take_back)
        self._claim = ArcClaim(
            self, self._controls, see=see, keeps_arc=keeps_arc, shows_stops=not watches, taken=self._orders.taken
        )
        self._consent = ConsentTalk(self, self._yield)
        self._hand_over = HandOver(self, self._yield)
        self._waiting = Waiting(self, self._hand_over, self._waits_for)
        self._presence = OperatorPresence(self)
        self._next: tuple[str, str] | None = None
        self.has_begun = asyncio.Event()
        """Set once the first claim or order is given, so that verbs are later than it."""
        self._switching = asyncio.Lock()

    @property
    def is_held(self) -> bool:
        """True while commands pass."""
        return self._claim.is_held

    @property
    def refusal(self) -> Refusal | None:
        """Why the claim was refused; None if it was not."""
        return self._claim.refusal

    @property
    def given_back(self) -> bool | None:
        """Whether the last release was confirmed; None before one."""
        return self._claim.given_back

    @property
    def arc_abilities(self) -> ArcAbilities | None:
        """Abilities of the ARC; None: not known."""
        return self._controls.abilities

    @property
    def is_ready(self) -> bool:
        """True while verbs can be called."""
        return self.state is LifeState.READY

    def take(self) -> None:
        """Claim the robot unless it is claimed; if its release is under way, right afterwards; its order ends."""
        self.touch()
        if not self._orders.touched(self._robot):
            self._claim.take()

    async def switch(self, robot: str, kind: str = "") -> None:
        """Stop and release the present robot, then claim another one.

        Orders of both robots continue; if the other robot has an order, the stick only turns to it. The present robot
        stays with the stick until the behavior of its order can take it. After several calls in a row the console
        claims the last robot; after a later release, none.

        Args:
            kind: Component type of the ARC; if it differs from the present one, the robot is released and claimed
                again. Empty: the present type for the same robot, else the type in the console's parameters.
        """
        self.touch()
        wished = self._next = (robot, kind)
        async with self._switching:
            await self._orders.wait_begun(self._robot)
            if wished != self._next:
                return
            now = self.parameters
            if robot != now.robot or kind not in ("", now.kind):
                self.parameters = msgspec.structs.replace(now, robot=robot, kind=kind or self._kind)
                await self._claim.give_back(f"{self.user} takes {robot}", for_good=True)
            if wished != self._next:
                return
            if self._orders.goes_on(robot):
                self.show(events.TurnedTo(self.clock.now_s(), robot))
            else:
                self.take()

    def touch(self) -> None:
        """Record that the operator is present; driving records that by itself."""
        self._presence.touch()
        self._orders.back()

    @property
    def orders(self) -> Mapping[str, GivenOrder]:
        """Robot → its order; a final order keeps its robot for the operator until the operator takes it."""
        return self._orders.orders

    def order(self, order: Order) -> int:
        """Give a robot an order; return the order's number; see ``order_group``."""
        return self.order_group([order])[0]

    def order_group(self, orders: Sequence[Order]) -> list[int]:
        """Give robots orders at the same time; ``OrderChanged`` events show the state of each.

        An order claims its robot with this console's priority, whether the stick holds the robot or not. A held robot
        stays with the stick until the order's behavior can take it. An earlier order of the robot ends. A held control
        moves nothing before it is released. A new press, ``take`` and ``interrupt`` end the order of the robot at the
        stick.

        Args:
            orders: One order for each robot; an order without a robot is for the robot at the stick.

        Returns:
            The number of each order, from 1, unique at this console.
        """
        self.touch()
        self.require_let_go()
        return self._orders.give(orders)

    def interrupt(self) -> None:
        """End the unfinished order of the robot at the stick, if any; the robot comes to rest."""
        if self._orders.goes_on(self._robot):
            self._orders.touched(self._robot)

    async def end_order(self, robot: str) -> None:
        """Return this robot to the mission, if it has an order; wait until its behavior has released it."""
        if await self._orders.give_back(robot, f"{self.user} gave it back"):
            self.acted(OperatorAction.RELEASE, robot, "its order was ended")

    def leave(self) -> None:
        """Stop the wheels and ignore held controls, because the operator turned away or the window lost the focus."""
        self._presence.leave()
        self.require_let_go()

    def require_let_go(self) -> None:
        """Stop the wheels; a held control moves nothing until it was released and pressed again.

        When: a dialog opens or closes. Stops, lifts, grants, and the loss of robot or link require it anyway.
        """
        self._controls.require_let_go()

    async def wait_granted(self) -> None:
        """Wait until the claim is granted.

        Raises:
            Refusal: The claim was refused.
        """
        await self._claim.wait_granted()

    def hold(self, drive: Motion, lasts_s: float | None = None) -> None:
        """Record that a drive key is down: the command repeats until the hold ends, then the wheels stop.

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
        """Handle a press of the control for one command: send it, unless the control must be released first."""
        self.touch()
        if self._controls.press_once(wish.word):
            self.interrupt()
            if self.is_held:
                self.start_task(self._give(wish), "command")

    async def do(self, command: Command) -> bool:
        """Send one command and show its outcome; return True if it was applied."""
        return not self._claim.rests and await self._controls.do(command)

    def begin_release(self) -> None:
        """Give the robot back without waiting for it."""
        self.start_task(self.give_back(), "release")

    async def give_back(self, reason: str = "released", *, for_good: bool = False, wanted: bool = True) -> None:
        """Release the robot and end its order, if any; afterwards the console watches until the next ``take``.

        Args:
            reason: For people.
            for_good: End the ARC even if the console usually keeps it.
            wanted: False if the operator did not request the release.
        """
        self._next = None
        robot, had_stick = self._robot, self._claim.is_asking
        had_order = await self._orders.give_back(robot, reason)
        await self._claim.give_back(reason, for_good=for_good, wanted=wanted)
        if had_order and not had_stick:
            self._claim.given_back = True
            self.answers.ended(True, reason)
            self.acted(OperatorAction.RELEASE, robot, reason)
            self.show(events.GivenBack(self.clock.now_s(), reason, True, wanted))

    async def _hand_to_order(self, robot: str, order: str) -> None:
        """Give the robot from the stick to its order, which waits for it: no lower ARC gets it in between."""
        if robot == self._robot and self._claim.is_asking:
            self.parameters = msgspec.structs.replace(self.parameters, robot=robot)
            await self._claim.give_back(f"ordered: {order}", to_order=True)

    def _take_back(self, robot: str) -> None:
        """Claim the robot for the stick, which has priority over the order."""
        if robot != self._robot:
            return
        if self.is_held and self._claim.holding == robot:
            self._orders.taken(robot)
        else:
            self.parameters = msgspec.structs.replace(self.parameters, robot=robot)
            self._claim.take()

    @property
    def _robot(self) -> str:
        """The robot at the stick; empty: any, or none."""
        return self.parameters.robot or self._claim.holding

    def begin_ask_consent(self, why: str = "") -> None:
        """Ask the consoles that hold the robot, and show their answers; if such a question is open, do nothing."""
        robot, is_waiting = self.parameters.robot, self._claim.is_asking and not self.is_held
        claim = Claim(self.parameters.arc(self.bus), robot, robot or ANY_ROBOT, self._claim.asked_s)
        self._consent.begin_ask(claim if is_waiting else None, why)

    def _consent_at_once(self, robot: str) -> Consent | None:
        """Return the answer to a question for this robot if no decision is needed; None: the operator decides."""
        if self.is_held or robot in self.orders:
            return Consent(False, self.user, "a script drives") if self._work is not None else None
        if self.orders:
            return Consent(False, self.user, "has given orders to other robots")
        return Consent(not self._claim.is_asking, self.user, "holds nothing")

    def _held_since(self, robot: str) -> tuple[str, float]:
        """Return this robot and the time of its order; without an order, the robot at the stick and its claim."""
        if robot in self.orders:
            return robot, self._orders.given_s(robot)
        return self._claim.holding if self.is_held else "", self._claim.asked_s

    async def _yield(self, robot: str, reason: str) -> None:
        """Release this robot if it has an order, else the robot at the stick."""
        if robot in self.orders and robot != self._robot:
            await self.end_order(robot)
        else:
            await self.give_back(reason)

    async def serve(self) -> None:
        """Claim, then receive events; a separate task sends the commands of held keys."""
        self.sign_in(f"to drive {self.parameters.robot or ANY_ROBOT}, with priority {self.parameters.priority}")
        if self._takes:
            self.take()
        if self._first_orders:
            self.show(events.TurnedTo(self.clock.now_s(), self.parameters.robot))
            self.order_group(self._first_orders)
        self.has_begun.set()
        self.start_task(self._controls.run(), "keys")
        if self.parameters.away_after_s > 0:
            self.start_task(self._presence.run(self.parameters.away_after_s, self._go_away), "presence")
        if self._work is not None:
            self.start_task(self._work_and_end(self._work), "work")
        await self.watch()

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer the ARC's notices and the questions of other consoles for the robot or a lift of a stop."""
        if isinstance(asked.body, AskConsent):
            return await self._consent.seek(asked.source, asked.body, self._consent_at_once(asked.body.robot))
        if isinstance(asked.body, WithdrawConsent):
            self.answers.withdrawn(asked.source, asked.body.user)
            return Consent(False, self.user, "withdrawn")
        if isinstance(asked.body, AskHandOver):
            return await self._hand_over.answer(asked.body, *self._held_since(asked.body.robot), self._work is not None)
        if isinstance(asked.body, AskLift) and self._work is not None:
            stopped_it = asked.body.console == self.address
            return Consent(False, self.user, "a script drives, and stopped it", is_here=stopped_it)
        if isinstance(asked.body, ChildReport):
            return self._orders.reported(asked.source, asked.body)
        if not isinstance(asked.body, ArcNotice):
            return await super().answer(asked)
        return await self._claim.answer(asked)

    async def drain(self) -> None:
        """Release all robots."""
        await asyncio.gather(self._orders.drain(), self._claim.give_back("the console ends", for_good=True))
        await super().drain()

    async def connect(self) -> None:
        """Subscribe to the mission's messages, and to this console's link."""
        await super().connect()
        self.bus.watch_link(lambda _is_up: self.require_let_go())

    def schedule_heard(self) -> None:
        """Ask why this console waits, if it does."""
        self._waiting.ask(self.parameters.arc(self.bus))

    def _waits_for(self) -> tuple[str, float] | None:
        return (self.parameters.robot, self._claim.asked_s) if self._claim.is_waiting else None

    async def _go_away(self) -> None:
        """Release the robot for useful work while its operator is away."""
        self.leave()
        self._orders.away(f"{self.user} is away")
        await self._claim.give_back(f"{self.user} is away", wanted=False)

    async def _give(self, wish: GiveWish) -> None:
        await self.do(wish)

    async def _work_and_end(self, work: Callable[[Teleoperation], Awaitable[None]]) -> None:
        await work(self)
        self.end("the work is done")
