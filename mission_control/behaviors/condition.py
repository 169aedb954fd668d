"""Condition: a leaf of the tree that tests an event, a report or a measured value against the mission file.

An *event* is a message that a component publishes when something happens: one of ``EVENTS``, or one of your own. A
*report* is a behavior's progress; the condition asks for it. *Readings* are the newest measurements of an RC's
hardware, such as the charge of a robot's battery; the condition asks for the newest ones and subscribes to changes.

Source: BehaviorTree.CPP 4, "ScriptCondition"; ``wait`` is an addition, because here nothing ticks a condition
repeatedly.
"""

from __future__ import annotations

import asyncio
import functools
import logging
import operator
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from msgspec import Meta

from backbone.creator.messages import ProcessFell
from backbone.errors import LinkError, Refusal
from backbone.import_faults import object_at
from backbone.keys import Conversation
from backbone.nameserver.messages import Appeared, Disappeared
from backbone.naming import Subsystem, component_of, is_component, is_legal
from backbone.rc_manager.messages import TraceLine
from backbone.spoken import value_text
from backbone.wire import Envelope, Message, plain
from mission_control.acting import cancel
from mission_control.behavior import Behavior, BehaviorParameters
from mission_control.behaviors.message_fields import never_equal, never_within, values_at, words_of
from mission_control.child_keeper import why
from mission_control.messages import AskBehavior, BehaviorState, BehaviorStatus, MotionSeen, WaypointReached
from resource_pool.arc_client import Readings, StopState, ask_readings, watch_readings

log = logging.getLogger(__name__)

EVENTS = (MotionSeen, WaypointReached, StopState, Appeared, Disappeared, ProcessFell, TraceLine)
"""All events that the project's own components publish."""
NAMED: Mapping[str, type[Message]] = {kind.__name__: kind for kind in (*EVENTS, BehaviorState, Readings)}
ANY = "*"
ASKED_FOR = {BehaviorState: Subsystem.MISSION_CONTROL, Readings: Subsystem.RESOURCE_POOL}
"""Answer that the condition asks for → subsystem whose components answer."""
ASK_AGAIN_S = 1.0  # chosen: mission time; a report changes with a way point or a turn, no faster
FIRST_READINGS_S = 5.0  # chosen: mission time; a robot that has just been granted answers within a second
REPLY_TIME_S = 1.0  # chosen: behaviors answer in milliseconds
_ABSENT = object()


@dataclass(frozen=True, slots=True)
class Comparison:
    """A test of a message. Pure.

    Attributes:
        field: Path to a field, names separated by dots; empty: every message will do.
        above: Lower limit of a number, excluded.
        below: Upper limit of a number, excluded.
        equals: Required value.
    """

    field: str = ""
    above: float | None = None
    below: float | None = None
    equals: str | float | bool | None = None

    def holds_for(self, message: Message) -> bool:
        """Return whether the message passes the test; a message without the field does not.

        Example:
            >>> seen = WaypointReached(12.0, "scout1", 3, 0)
            >>> Comparison("number", above=2).holds_for(seen), Comparison("robot", equals="scout2").holds_for(seen)
            (True, False)
        """
        value = self._value(message)
        if value is _ABSENT:
            return False
        if self.equals is not None and not (
            isinstance(value, bool) is isinstance(self.equals, bool) and value == self.equals
        ):
            return False
        if self.above is None and self.below is None:
            return True
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return is_number and (self.above is None or value > self.above) and (self.below is None or value < self.below)

    def finding(self, message: Message) -> str:
        """Return the tested value, for people."""
        value = self._value(message)
        if not self.field:
            return "it came"
        return f"{self.field} is missing" if value is _ABSENT else f"{self.field} is {value_text(value)}"

    def __str__(self) -> str:
        limits = [f"above {self.above:g}"] if self.above is not None else []
        limits += [f"below {self.below:g}"] if self.below is not None else []
        limits += [value_text(self.equals)] if self.equals is not None else []
        return f"{self.field} {' and '.join(limits) or 'present'}" if self.field else "any"

    def _value(self, message: Message) -> Any:
        value = plain(message)
        for name in self.field.split(".") if self.field else ():
            if not isinstance(value, dict) or name not in value:
                return _ABSENT
            value = value[name]
        return value


class MessageConditionParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``MessageCondition``.

    Attributes:
        source: The component: its name, or its address; '*' for any. A console's address must be written.
        message: The event, such as MotionSeen; BehaviorState for a behavior's report; Readings for what an RC measures;
            or the class of an event of your own, as package.module:Class.
        field: Field of the message, such as region.width_px, payload.waypoints_reached or values.battery_share; empty:
            every message will do.
        above: The field must be a number above this.
        below: The field must be a number below this.
        equals: The field must be this.
        mode: wait: success at the first message that is like that. check: the first message decides between success
            and failure; readings that are not there within 5 s of its start or of a change are a failure.
    """

    source: Annotated[str, Meta(extra_json_schema={"names": "source"})] = ANY
    message: str
    field: str = ""
    above: float | None = None
    below: float | None = None
    equals: str | float | bool | None = None
    mode: Literal["check", "wait"] = "wait"

    def __post_init__(self) -> None:
        if not (self.source == ANY or is_legal(self.source) or is_component(self.source)):
            raise ValueError(f"source is {self.source!r}: write a component's name or address, or {ANY} for any")
        kind = message_class(self.message)
        if not self.field and (self.above, self.below, self.equals) != (None, None, None):
            raise ValueError("field is empty: name the field that is compared")
        if self.above is not None and self.below is not None and self.above >= self.below:
            raise ValueError(f"above is {self.above:g} and below is {self.below:g}: no number is between them")
        if self.field and kind is not Readings:  # the values of readings are known to the RC; ``check`` compares them
            self._check_field(kind)
        if kind in ASKED_FOR and (self.source == ANY or _asked_at(kind, self.source) is None):
            asked = "behavior whose report is" if kind is BehaviorState else "RC whose readings are"
            raise ValueError(f"source is {self.source}: name the {asked} asked for")

    def _check_field(self, kind: type[Message]) -> None:
        types, of = values_at(kind, self.field), f"{self.field} of {kind.__name__}"
        if self.equals is not None and never_equal(types, self.equals):
            words = words_of(types)
            there = f"; write one of {', '.join(words)}" if words else ""
            raise ValueError(f"equals is {value_text(self.equals)}, and {of} is never that{there}")
        limits = {"above": self.above, "below": self.below}
        for name, limit in limits.items():
            if limit is not None and never_within(types, **{**dict.fromkeys(limits), name: limit}):
                raise ValueError(f"{name} is {limit:g}, and {of} is never {name} it")


class MessageCondition(Behavior[MessageConditionParameters]):
    """Succeeds if a message passes the test. Otherwise ``check`` fails, and ``wait`` waits for the next message."""

    parameters_type = MessageConditionParameters
    fixed = Behavior.fixed | {"source", "message"}
    children_allowed = (0, 0)
    may_claim = False
    _giving_up: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Subscribe to the event, or begin to ask for reports."""
        given = self.parameters
        self._kind = message_class(given.message)
        self.parameters_changed()
        if self._kind in ASKED_FOR:
            self._begin_to_ask()
            return
        source = given.source if "/" in given.source else f"*/{given.source}"
        known: Any = functools.reduce(operator.or_, dict.fromkeys((*EVENTS, self._kind)))
        self.bus.subscribe(source, Conversation.EVENTS, known, self._heard)

    def parameters_changed(self) -> None:
        """Use the new comparison and mode from now on; a check of readings has its whole time again."""
        given = self.parameters
        self._comparison = Comparison(given.field, given.above, given.below, given.equals)
        self.report(f"waits for {given.message} of {given.source}: {self._comparison}")
        cancel(self._giving_up)
        if given.mode == "check" and message_class(given.message) is Readings:
            self._giving_up = self.start_task(self._give_up(component_of(given.source)), "give up")

    def _begin_to_ask(self) -> None:
        source = _asked_at(self._kind, self.parameters.source)
        assert source is not None  # noqa: S101  the parameters were checked
        if self._kind is BehaviorState:
            ask = functools.partial(self.bus.ask, source, AskBehavior(), BehaviorState, within_s=REPLY_TIME_S)
            self.start_task(self._ask(source, ask), "ask")
            return
        rc = component_of(source)
        watch_readings(self.bus, self._judge, rc)
        self.start_task(self._ask(source, functools.partial(ask_readings, self.bus, rc)), "ask")

    async def _ask(self, source: str, ask: Callable[[], Awaitable[Message]]) -> None:
        """Ask and test the answer repeatedly, until a result is final."""
        while not self.status.is_final:
            try:
                self._judge(await ask())
            except LinkError as error:
                log.info("%s does not report: %s", source, error)
            except Refusal as refusal:
                self.finish(BehaviorStatus.FAILURE, why(refusal))
            await self.clock.sleep_s(ASK_AGAIN_S)

    async def _give_up(self, rc: str) -> None:
        """Fail if no readings have arrived by then, so that a tree does not wait for a robot that no ARC holds."""
        await self.clock.sleep_s(FIRST_READINGS_S)
        self.finish(BehaviorStatus.FAILURE, {"detail": f"{rc} had no readings within {FIRST_READINGS_S:g} s"})

    def _heard(self, envelope: Envelope[Message]) -> None:
        if isinstance(envelope.body, self._kind):
            self._judge(envelope.body)

    def _judge(self, message: Message) -> None:
        if isinstance(message, Readings) and message.at_s < 0.0:
            return  # the RC has no readings of its hardware yet
        finding = self._comparison.finding(message)
        if self._comparison.holds_for(message):
            self.finish(BehaviorStatus.SUCCESS, {"detail": finding})
        elif self.parameters.mode == "check":
            self.finish(BehaviorStatus.FAILURE, {"detail": f"{finding}, wanted: {self._comparison}"})


def message_class(name: str) -> type[Message]:
    """Return the message class of this name or class path.

    Raises:
        ValueError: There is no such class.
    """
    if name in NAMED:
        return NAMED[name]
    if ":" not in name:
        raise ValueError(f"message is {name!r}: write one of {', '.join(sorted(NAMED))}, or package.module:Class")
    try:
        found = object_at(name)
    except (ImportError, AttributeError, ValueError) as error:
        raise ValueError(f"message is {name!r}: {error}") from error
    if not (isinstance(found, type) and issubclass(found, Message)):
        raise ValueError(f"message is {name!r}, which is no message")
    return found


def _asked_at(kind: type[Message], source: str) -> str | None:
    """Return the address of the component that answers; None: no component of that kind answers."""
    given = source if "/" in source else f"{ASKED_FOR[kind]}/{source}"
    return given if given.startswith(f"{ASKED_FOR[kind]}/") else None
