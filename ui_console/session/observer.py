"""A console that only watches: it receives the mission's messages, and claims no robot."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine
from typing import ClassVar, Generic, TypeVar

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.asking import ask_until_answered
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component.mission_time import MissionStart, ask_time
from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed, OperatorAction
from backbone.printable import printable_all
from backbone.scheduling.views import Schedule
from backbone.spoken import value_text
from backbone.wire import Accepts, Envelope, Message
from ui_console.model.consent import Consent, Topic, require_console
from ui_console.model.events import ConsoleEvent, Heard, LinkHeard
from ui_console.model.lifting import AskLift
from ui_console.session.consent_answers import ConsentAnswers
from ui_console.session.feed import REPLY_TIME_S, ConsoleFeed, FeedEvent
from ui_console.session.lift_talk import LiftTalk
from ui_console.session.map_feed import MapFeed

log = logging.getLogger(__name__)

FACTS_WITHIN_S = 5.0  # chosen: a restarted core service is back within a second or two; machine seconds

T = TypeVar("T")
Reply = TypeVar("Reply", bound=Message)
P_co = TypeVar("P_co", bound=msgspec.Struct, covariant=True)

UNLISTED = "robots that this console does not know"
"""Named beside robots whose stop is not confirmed, if the nameserver did not list the mission's robots."""


def no_person_here(_user: str) -> ConsentAnswers | None:
    """Return None, because a console that only a program reads has no person to ask."""
    return None


class Observer(Component[P_co], Generic[P_co]):
    """Passes the mission's events to a screen, and offers the actions that need no grant.

    Args:
        show: Called in the event loop with each event, in order.
        watches: False for a console that shows its own events only.
        signs_in: True: publish the operator's arrival and departure; False if another component does.
        user: The person at the console, for the record; empty: the console's name.
        answers: The questions to its operator; None: new ones.
        answers_of: Returns the questions to this person, or None for a person who left; None: only one person uses the
            console.
        has_map: True: also show bodies' places and the plan of the floor, while ``map.watch`` is set because a page
            shows the map.
    """

    accepts: ClassVar[Accepts | None] = AskLift

    def __init__(
        self,
        launch: Launch,
        bus: Bus,
        clock: Clock,
        *,
        show: Callable[[ConsoleEvent], None],
        watches: bool = True,
        signs_in: bool = True,
        user: str = "",
        answers: ConsentAnswers | None = None,
        answers_of: Callable[[str], ConsentAnswers | None] | None = None,
        has_map: bool = False,
    ) -> None:
        super().__init__(launch, bus, clock)
        self.show: Callable[[ConsoleEvent], None] = lambda event: show(printable_all(event))
        """Show an event; quotations from the bus in it are printable text."""
        self._watches, self._signs_in = watches, signs_in
        self.user = user or launch.name
        self.feed = ConsoleFeed(bus, clock, self._heard)
        """Its subscriptions, and the verbs that need no grant."""
        self.map = MapFeed(bus, clock, self.show) if has_map else None
        """Its subscription to places; None: it shows no map."""
        self.answers = answers or ConsentAnswers(bus, self.user, clock, self.show, self.acted)
        """The questions to its operator."""
        self._stops: set[asyncio.Task[object]] = set()
        self._start, self._was_cut = MissionStart(), False
        self._answers_of = answers_of or (lambda user: self.answers if user in (self.user, self.address) else None)

    def acted(self, action: OperatorAction, subject: str, detail: str = "", user: str = "") -> None:
        """Record and publish an action of the operator: one event for each action.

        Args:
            subject: Name of its object.
            detail: For people.
            user: The person who did it; empty: the person at this console.
        """
        act = OperatorActed(user or self.user, action, subject, detail, self.clock.now_s())
        self.story.note(subject, act.sentence, act.event(self.address).level, act.user)
        self.bus.publish(self.address, Conversation.OPERATORS, act)

    async def stop_robot(self, robot: str, reason: str = "", user: str = "") -> bool:
        """Stop a robot, regardless of its holder; return whether the stop is confirmed.

        If the robot does not answer, its stop is repeated until it does or this console ends.
        """
        self.require_let_go()
        self.acted(OperatorAction.STOP_ROBOT, robot, reason, user)
        return not await self._carried_out(self.feed.stop_robots([robot], reason, user or self.user))

    async def stop_all(self, reason: str = "", user: str = "") -> list[str]:
        """Stop all robots of the mission, regardless of their holders; return the robots whose stop is not confirmed.

        Known robots are stopped at once, before the nameserver is asked for further ones. If it does not answer, the
        result names ``UNLISTED`` too. The stop of a robot that does not answer is repeated as by ``stop_robot``.
        """
        self.require_let_go()
        known, user = self.feed.robots, user or self.user
        names = ", ".join(sorted(known)) or "all there are"
        self.acted(OperatorAction.STOP_ALL, "robots", f"{names}{f', {reason}' if reason else ''}", user)
        return await self._carried_out(self._stop_all(known, reason, user))

    async def lift_stop(
        self, robot: str, number: int, user: str = "", show: Callable[[ConsoleEvent], None] | None = None
    ) -> bool:
        """Lift a robot's stop if the stop's authors agree; return whether the robot may move.

        Args:
            number: Number of the stop on the screen: a newer stop is not lifted.
            user: The person who lifts it; empty: the person at this console.
            show: Called with the authors' answers; None: this console's screens show them.
        """
        return await LiftTalk(self, user or self.user, show or self.show).lift(robot, number)

    def decide(self, is_given: bool, reason: str = "", number: int | None = None) -> None:
        """Answer the first question to this operator: for the held robot, or to lift a stop; see ``ConsentDesk``."""
        self.answers.decide(is_given, reason, number)

    async def set_parameter(self, name: str, parameter: str, value: object, user: str = "") -> bool:
        """Set a parameter of a component; return whether the component applied it."""
        is_set = await self.feed.set_parameter(name, parameter, value, user or self.user)
        detail = f"{parameter} = {value_text(value)}{'' if is_set else ', which it did not take'}"
        self.acted(OperatorAction.SET_PARAMETER, name, detail, user)
        return is_set

    def acknowledged(self, count: int, key: str = "", user: str = "") -> None:
        """Publish that the operator acknowledged this number of alarms, of one key or all."""
        if count:
            self.acted(OperatorAction.ACKNOWLEDGE, "alarms", key or f"all {count}", user)

    async def why(self, name: str) -> list[str]:
        """Return the explanation of the state of this robot, ARC, behavior, console or component, for people."""
        return await self.feed.why(name)

    def person(self) -> str:
        """Return the person at this console; empty for a console that serves other people and has its own name."""
        return self.user if self.user != self.name else ""

    async def ask_core(self, of: str, question: Message, reply: type[Reply]) -> Reply:
        """Return the answer of a core service, which may be restarting.

        Raises:
            LinkError: It did not answer within ``FACTS_WITHIN_S``.
            Refusal: It refused the question.
        """
        return await ask_until_answered(
            self.bus, self.clock, of, question, reply, each_s=REPLY_TIME_S, within_s=FACTS_WITHIN_S
        )

    async def connect(self) -> None:
        """Subscribe to the mission's messages."""
        self.bus.watch_link(self._heard_link)
        self.start_task(self.feed.unanswered.run(), "unanswered stops")
        if self._watches:
            self.feed.listen()
        if self.map is not None:
            self.map.listen()

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Ask the author of a stop whether it may be lifted."""
        match asked.body:
            case AskLift(robot=robot, author=author, user=user, why=why):
                require_console(self.name, asked.source)
                answers = self._answers_of(author)
                if answers is None:
                    return Consent(False, author, "is not here", is_here=False)
                return await answers.seek(asked.source, user, robot, why, Topic.LIFT)
            case _:
                return await super().answer(asked)

    async def drain(self) -> None:
        """Wait until no emergency stop is under way; publish that the operator left."""
        while self._stops:
            await asyncio.wait(self._stops)  # its exceptions are for who gave the stop
        if self._signs_in:
            self.acted(OperatorAction.DETACH, self.name)

    async def serve(self) -> None:
        """Publish that the operator is present, then watch."""
        self.sign_in("to watch")
        await self.watch()

    def sign_in(self, intent: str) -> None:
        """Publish that the operator is present, and the purpose."""
        if self._signs_in:
            self.acted(OperatorAction.ATTACH, self.name, intent)

    async def watch(self) -> None:
        """Receive the mission's state, and then its changes; until cancelled."""
        if self.map is not None:
            self.start_task(self.map.run(), "map")
        if self._watches:
            await self.feed.run()

    def schedule_heard(self) -> None:
        """React to a new schedule. When: after it was shown."""

    def require_let_go(self) -> None:
        """Ignore held controls until they were released. When: before a stop, and when the hub does not answer."""

    async def _stop_all(self, known: frozenset[str], reason: str, user: str) -> list[str]:
        stopping = self.feed.stop_robots(known, reason, user), self._stop_others(known, reason, user)
        unsure, unsure_others = await asyncio.gather(*stopping)
        return unsure + unsure_others

    async def _stop_others(self, known: frozenset[str], reason: str, user: str) -> list[str]:
        found = await self.feed.find_robots()
        return [UNLISTED] if found is None else await self.feed.stop_robots(found - known, reason, user)

    async def _carried_out(self, stop: Coroutine[object, None, T]) -> T:
        """Return the outcome of an emergency stop, which neither a cancellation nor the end of the console cuts off."""
        task = asyncio.create_task(stop, name=f"{self.name}:emergency stop")
        self._stops.add(task)
        task.add_done_callback(self._stops.discard)
        return await asyncio.shield(task)

    def _heard_link(self, is_up: bool) -> None:
        self._was_cut |= not is_up
        if is_up:
            self.start_task(self._compare_times(), "the mission's time")

    async def _compare_times(self) -> None:
        """End if the link leads to a later mission of the same name; else have the clock show the mission's time."""
        heard = await ask_time(self.bus, self.clock)
        if self._was_cut and self._start.is_over(heard):
            log.warning("%s ends: its mission was started again", self.name)
            self.end("its mission was started again")
        else:
            self._start.follow(heard, self.clock)

    def _heard(self, event: FeedEvent) -> None:
        self.show(event)
        if self.map is not None and isinstance(event, Heard):
            self.map.heard(event.body)
        match event:
            case Heard(body=Schedule()):
                self.schedule_heard()
            case LinkHeard(is_up=False):
                self.require_let_go()


AnyObserver = Observer[msgspec.Struct]
"""An observer with any kind of parameters."""
