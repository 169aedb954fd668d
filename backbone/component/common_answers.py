"""The answers to the questions that every component answers."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import ClassVar, Protocol

import msgspec

from backbone.bus.clock import VirtualClock
from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.component.messages import (
    MESSAGES_DROPPED,
    PROCESSOR_S,
    AskParameters,
    AskState,
    AskStatistics,
    AskStory,
    AskTime,
    ComponentState,
    MissionTime,
    OtherIncarnation,
    Parameters,
    SetParameter,
    Statistics,
    Stop,
    Stopping,
    Story,
    WrongParameter,
)
from backbone.component.story import StoryBook
from backbone.spoken import value_text
from backbone.wire import Envelope, Message


class Answering(Protocol):
    """The component that is asked; see ``Component``."""

    launch: Launch
    bus: Bus
    clock: Clock
    story: StoryBook
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

    def end(self, reason: str) -> None:
        """End in good order."""

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer a question of its own."""


class CommonAnswers:
    """Answers for one component.

    Args:
        component: The component that is asked, and that orders end or change.
    """

    def __init__(self, component: Answering) -> None:
        self._component = component

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer a common question; the component answers all others.

        Raises:
            OtherIncarnation: The order to stop is for another process.
            WrongParameter: No such parameter, or a value that does not fit.
            Refusal: The component refuses the value or the question.
        """
        component = self._component
        match asked.body:
            case AskState():
                return component.answered_state()
            case AskTime():
                return MissionTime(component.clock.now_s(), component.clock.rate, time.time())
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
        return Statistics({**counts, **process, **dropped, **self._component.statistics()})

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
        component.change_parameters({name: value})
        component.story.note(name, f"{user} set {name} from {value_text(old[name])} to {value_text(value)}")
        return Parameters(msgspec.to_builtins(component.parameters))
