"""The answers to the questions that every component answers."""

from __future__ import annotations

import time
from collections.abc import Mapping
from itertools import islice
from numbers import Integral, Real
from typing import ClassVar, Protocol

import msgspec

from backbone.bus.clock import VirtualClock
from backbone.component.component_of_parts import ComponentOfParts
from backbone.component.messages import (
    MESSAGES_DROPPED,
    PROCESSOR_S,
    AskParameters,
    AskState,
    AskStatistics,
    AskStory,
    AskTime,
    ComponentState,
    LogLevel,
    MissionTime,
    OtherIncarnation,
    ParameterBug,
    Parameters,
    SetParameter,
    Statistics,
    Stop,
    Stopping,
    Story,
    WrongParameter,
)
from backbone.component.parameter_values import parameters_from
from backbone.errors import Refusal, complaint
from backbone.ranges import LONGEST_MENTION, MOST_ENTRIES, MOST_MEASURE
from backbone.spoken import value_text
from backbone.wire import Envelope, Message


class Answering(ComponentOfParts, Protocol):
    """The component that is asked; see ``Component``."""

    fixed: ClassVar[frozenset[str]]

    @property
    def parameters(self) -> msgspec.Struct:
        """The parameters in force."""

    def answered_state(self) -> ComponentState:
        """Return address, process and state, for an answer."""

    def statistics(self) -> dict[str, float]:
        """Return the component's own counts."""

    def change_parameters(self, changed: Mapping[str, object]) -> None:
        """Replace the values of these parameters."""

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer a question of its own."""


class CommonAnswers:
    """Answers for one component.

    Args:
        component: The component that is asked, and that orders end or change.
    """

    def __init__(self, component: Answering) -> None:
        self._component = component
        self._has_warned = False

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer a common question; the component answers all others.

        Raises:
            OtherIncarnation: The order to stop is for another process.
            WrongParameter: No such parameter, or a value that does not fit.
            ParameterBug: The component has a bug in ``parameters_changed``, which ends it.
            Refusal: The component refuses the value or the question.
        """
        component = self._component
        match asked.body:
            case AskState():
                return component.answered_state()
            case AskTime():
                clock, origin_s = component.clock, component.launch.clock_origin_monotonic_s
                return MissionTime(clock.now_s(), clock.rate, time.time(), origin_s)
            case AskStatistics():
                return self._statistics()
            case AskParameters():
                return Parameters(msgspec.to_builtins(component.parameters))
            case SetParameter(name=name, value=value, user=user):
                return self._set_parameter(name, value, user or asked.source)
            case AskStory(subject=subject):
                return Story(component.story.of(subject))
            case Stop(incarnation=meant) if meant not in ("", component.launch.incarnation):
                lives = f"{component.launch.address} lives as {component.launch.incarnation}, not {meant}"
                raise OtherIncarnation(lives, meant=meant)
            case Stop(reason=reason):
                component.end(reason or f"stopped by {asked.source}")
                return Stopping()
            case _:
                return await component.answer(asked)

    def _statistics(self) -> Statistics:
        bus, clock = self._component.bus, self._component.clock
        counts = {f"bus_{name}": float(value) for name, value in msgspec.structs.asdict(bus.statistics()).items()}
        is_virtual = isinstance(clock, VirtualClock)  # a mission on virtual time is the same each time
        process = {} if is_virtual else {PROCESSOR_S: time.process_time()}
        dropped = {f"{MESSAGES_DROPPED}{key}": float(count) for key, count in bus.dropped().items()}
        common = {**counts, **process, **dropped}
        return Statistics({**common, **self._own_statistics(MOST_ENTRIES - len(common))})

    def _own_statistics(self, most: int) -> dict[str, float]:
        """Return those that a message can hold, at most so many; the first time that any is missing, log it."""
        try:
            own = dict(self._component.statistics())
        except Exception as bug:  # people ask for them at any time, and no work of the component needs them
            self._warn(f"its own statistics are missing: {complaint(bug)}")
            return {}
        legal = dict(islice(((name, float(value)) for name, value in own.items() if is_measure(name, value)), most))
        left_out = next((name for name in own if name not in legal), None)
        if left_out is not None:
            fits = f"at most {MOST_ENTRIES} finite numbers, with names of at most {LONGEST_MENTION} characters"
            self._warn(f"its statistics are without {left_out!r}, which is {own[left_out]!r}; they hold {fits}")
        return legal

    def _warn(self, what: str) -> None:
        """Publish a warning about the statistics, the first time."""
        if not self._has_warned:
            self._has_warned = True
            self._component.publish_event("statistics", what, LogLevel.WARNING)

    def _set_parameter(self, name: str, value: object, user: str) -> Parameters:
        component, old = self._component, msgspec.to_builtins(self._component.parameters)
        if name not in old:
            has = ", ".join(sorted(old)) or "none"
            raise WrongParameter(f"{component.launch.name} has no parameter {name!r}; it has: {has}")
        if name in component.fixed:
            raise WrongParameter(
                f"{component.launch.name} cannot change {name} while it runs",
                remedy="Start it again with the new value: a behavior by 'scout-backbone tree replace', "
                "a console by its options.",
            )
        try:
            component.change_parameters({name: value})
        except Refusal:
            raise
        except Exception as bug:  # it ends the component as any bug, but the requester learns why
            component.fail(bug)
            raise ParameterBug(self._consequence(bug, name, value)) from bug
        component.story.note(name, f"{user} set {name} from {value_text(old[name])} to {value_text(value)}")
        return Parameters(msgspec.to_builtins(component.parameters))

    def _consequence(self, bug: Exception, name: str, value: object) -> str:
        """Return what failed, where, and which value holds afterwards."""
        component = self._component
        at_start = parameters_from(component.launch.parameters, type(component.parameters))
        again = value_text(msgspec.to_builtins(at_start)[name])
        return (
            f"{component.launch.name} has a bug that ends it when {name} is {value_text(value)}: {complaint(bug)}; "
            f"if it is started again, {name} is {again}"
        )


def is_measure(name: object, value: object) -> bool:
    """Return whether a message can hold this statistic.

    Example:
        >>> is_measure("queue_s", 0.5), is_measure("queue_s", float("nan")), is_measure("queue_s", "long")
        (True, False, False)
    """
    if isinstance(value, bool) or not isinstance(value, Real) or not isinstance(name, str):
        return False
    size: float | int = int(abs(value)) if isinstance(value, Integral) else float(abs(value))
    return len(name) <= LONGEST_MENTION and size <= MOST_MEASURE
