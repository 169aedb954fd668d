"""A console that only watches: it hears what the mission tells, and claims nothing."""

from __future__ import annotations

import asyncio
import types
from collections.abc import Callable
from typing import Any, ClassVar, Generic, TypeVar

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed, OperatorAction
from backbone.printable import printable_all
from backbone.scheduling.views import Schedule
from backbone.spoken import value_text
from backbone.wire import Envelope, Message
from ui_console.model.consent import Consent, Topic, require_console
from ui_console.model.events import ConsoleEvent, Heard, LinkHeard
from ui_console.model.lifting import AskLift
from ui_console.session.consent_answers import ConsentAnswers
from ui_console.session.feed import ConsoleFeed, FeedEvent
from ui_console.session.lift_talk import LiftTalk

P = TypeVar("P", bound=msgspec.Struct)


def nobody_here(_user: str) -> ConsentAnswers | None:
    """Return where a person is asked at a console that only a program reads: nowhere."""
    return None


class Observer(Component[P], Generic[P]):
    """Tells a face what it hears, and lends it the verbs that need no grant.

    Args:
        show: Called in the event loop with each event, in order.
        watches: False for one that is content with its own events.
        signs_in: Tell the mission that its operator came and left; False where somebody else does.
        user: Who sits at it, for the record; empty: the console's name.
        answers: What its operator is asked; None: something of its own.
        answers_of: Returns where a person of this name is asked, None if they left; None: one person sits here.
    """

    accepts: ClassVar[types.UnionType | type[Any] | None] = AskLift

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
    ) -> None:
        super().__init__(launch, bus, clock)
        self.show: Callable[[ConsoleEvent], None] = lambda event: show(printable_all(event))
        """Show an event; whatever it quotes of the bus is printable text from here on."""
        self._watches, self._signs_in = watches, signs_in
        self.user = user or launch.name
        self.feed = ConsoleFeed(bus, clock, self._heard)
        """What it listens by, and the verbs that need no grant."""
        self.answers = answers or ConsentAnswers(self.user, clock, self.show, self.acted)
        """What its operator is asked."""
        self._answers_of = answers_of or (lambda user: self.answers if user in (self.user, self.address) else None)

    # ------------------------------------------------------------------ what the operator did
    def acted(self, action: OperatorAction, subject: str, detail: str = "", user: str = "") -> None:
        """Keep that the operator did this, and let the mission know: one event for each action.

        Args:
            action: What.
            subject: Name of whom or what it was done to.
            detail: For people.
            user: Who did it; empty: who sits at this console.
        """
        act = OperatorActed(user or self.user, action, subject, detail, self.clock.now_s())
        self.story.note(subject, act.sentence, act.event(self.address).level, act.user)
        self.bus.publish(self.address, Conversation.OPERATORS, act)

    # ------------------------------------------------------------------ verbs that need no grant
    async def stop_robot(self, robot: str, reason: str = "", user: str = "") -> bool:
        """Stop a robot, whoever holds it; return whether that is certain."""
        self.require_let_go()
        self.acted(OperatorAction.STOP_ROBOT, robot, reason, user)
        return not await self.feed.stop_robots([robot], reason, user or self.user)

    async def stop_all(self, reason: str = "", user: str = "") -> list[str]:
        """Stop every robot of the mission, whoever holds it; return those of which it is not certain.

        Those that are known are stopped at once, before anybody is asked whether there are more.
        """
        self.require_let_go()
        known, user = self.feed.robots, user or self.user
        names = ", ".join(sorted(known)) or "whatever there is"
        self.acted(OperatorAction.STOP_ALL, "robots", f"{names}{f', {reason}' if reason else ''}", user)
        unsure, found = await asyncio.gather(self.feed.stop_robots(known, reason, user), self.feed.find_robots())
        return unsure + await self.feed.stop_robots(found - known, reason, user)

    async def lift_stop(
        self, robot: str, number: int, user: str = "", show: Callable[[ConsoleEvent], None] | None = None
    ) -> bool:
        """Let a robot move again that was stopped, if those who stopped it let it; return whether it may.

        Args:
            robot: Which.
            number: Of the stop that was seen on the screen: a newer one is not lifted.
            user: Who wants it; empty: who sits at this console.
            show: Called with what others say to it; None: this console's screens show it.
        """
        return await LiftTalk(self, user or self.user, show or self.show).lift(robot, number)

    def decide(self, is_given: bool, reason: str = "") -> None:
        """Answer who asks this operator first: for the robot that is held here, or to lift a stop."""
        self.answers.decide(is_given, reason)

    async def set_parameter(self, name: str, parameter: str, value: Any, user: str = "") -> bool:
        """Have a component run with another value; return whether it does."""
        is_set = await self.feed.set_parameter(name, parameter, value, user or self.user)
        detail = f"{parameter} = {value_text(value)}{'' if is_set else ', which it did not take'}"
        self.acted(OperatorAction.SET_PARAMETER, name, detail, user)
        return is_set

    def acknowledged(self, count: int, key: str = "", user: str = "") -> None:
        """Tell that the operator has seen so many alarms; those of one key, or all."""
        if count:
            self.acted(OperatorAction.ACKNOWLEDGE, "alarms", key or f"all {count}", user)

    async def why(self, name: str) -> list[str]:
        """Return for people why this robot, ARC, behavior, console or component is as it is."""
        return await self.feed.why(name)

    # ------------------------------------------------------------------ the component's hooks
    def person(self) -> str:
        """Return who sits here; empty for a console that serves others, and bears its own name."""
        return self.user if self.user != self.name else ""

    async def connect(self) -> None:
        """Listen to what the mission tells."""
        if self._watches:
            self.feed.listen()

    async def answer(self, asked: Envelope[Any]) -> Message:
        """Have whom the question is for decide whether a stop may be lifted."""
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
        """Tell that the operator left."""
        if self._signs_in:
            self.acted(OperatorAction.DETACH, self.name)

    async def serve(self) -> None:
        """Tell that the operator is there, then watch."""
        self.sign_in("to watch")
        await self.watch()

    def sign_in(self, intent: str) -> None:
        """Tell that the operator is there, and for what."""
        if self._signs_in:
            self.acted(OperatorAction.ATTACH, self.name, intent)

    async def watch(self) -> None:
        """Hear how things are, and then what changes; until cancelled."""
        if self._watches:
            await self.feed.run()

    def schedule_heard(self) -> None:
        """Take note that there is a new schedule. When: after it was shown."""

    def require_let_go(self) -> None:
        """Have what is held move nothing until it was let go. When: before a stop, and when the hub does not answer."""

    def _heard(self, event: FeedEvent) -> None:
        self.show(event)
        match event:
            case Heard(body=Schedule()):
                self.schedule_heard()
            case LinkHeard(is_up=False):
                self.require_let_go()
