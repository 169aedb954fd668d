"""Implementations of a behavior: checks an exchange, creates the new implementation, and hands state over.

Rule of this file: no function waits or starts tasks; ``behavior_exchange`` carries out the exchange.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar, Protocol, Self

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.component_of_parts import ComponentOfParts
from backbone.component.launch import Launch
from backbone.component.messages import WrongParameter
from backbone.errors import complaint
from backbone.exchange import NotExchanged, SwapClass
from backbone.exchange_course import UNPROVED, class_path_of, hand_over
from backbone.mission.behavior_nodes import BehaviorNode
from backbone.reading_anew import WrongClass
from backbone.wire import Accepts, Message
from mission_control.gated_bus import GatedBus
from mission_control.messages import BehaviorStatus


class Implementation(ComponentOfParts, Protocol):
    """The interface of a behavior that its exchange needs."""

    accepts: ClassVar[Accepts | None]
    parameters_type: ClassVar[type[msgspec.Struct]]
    gate: GatedBus
    status: BehaviorStatus
    child_nodes: dict[str, BehaviorNode]
    has_begun: bool

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None: ...

    @property
    def parameters(self) -> msgspec.Struct:
        """Its parameters."""

    @property
    def is_ordered(self) -> bool:
        """True: an operator ordered it."""

    async def run(self) -> None:
        """Run."""

    def is_ready(self) -> bool:
        """Return whether it can take charge."""

    def parameters_changed(self) -> None:
        """Apply the parameters."""

    def robot_obeyed(self, command: Message) -> None:
        """Take a command of the class in charge into account."""

    def go_on_from(self, other: Self) -> None:
        """Take over the state of another implementation of the component, and its exchanges."""

    def take_charge(self) -> None:
        """Send commands from now on."""

    def stand_by(self) -> None:
        """Send no more commands."""


Load = Callable[[str], type[Implementation]]
"""Returns the behavior class at a class path, or raises a refusal."""


def check_exchangeable(old: Implementation) -> None:
    """Refuse an exchange that would lose state of the running behavior.

    Raises:
        NotExchanged: The behavior has finished, has children, is an operator's order, or is still starting.
    """
    name = old.launch.name
    if old.status.is_final:
        raise NotExchanged(f"{name} has finished", remedy="Start it again, with the new class in its mission file.")
    if old.child_nodes:
        raise NotExchanged(
            f"{name} has children, which a new class would begin anew",
            remedy=f"Exchange a behavior without children, or see 'scout-backbone tree replace {name}'.",
        )
    if old.is_ordered:
        raise NotExchanged(f"{name} is an operator's order", remedy="Let the operator give the order anew.")
    if not old.has_begun:
        raise NotExchanged(f"{name} is still starting", remedy="Swap again in a moment.")


def made_beside(old: Implementation, asked: SwapClass, kind: type[Implementation]) -> Implementation:
    """Return the new implementation; it does not run yet.

    Raises:
        WrongClass: The class cannot be instantiated, or accepts other messages.
        WrongParameter: The class has no such parameters.
    """
    if kind.accepts != old.accepts:
        raise WrongClass(
            f"{asked.class_path} answers other questions than {class_path_of(old)}",
            remedy="Accept the same messages, or change the mission file.",
        )
    had, gate = msgspec.to_builtins(old.parameters), GatedBus(old.gate.bus, is_first=False)
    try:
        has = {one.encode_name for one in msgspec.structs.fields(kind.parameters_type)}
        values = {name: value for name, value in had.items() if name in has} | asked.parameters
        launch = msgspec.structs.replace(old.launch, class_path=asked.class_path, parameters=values)
        new = kind(launch, gate, old.clock)
    except WrongParameter as wrong:
        raise WrongParameter(
            f"{asked.class_path} refuses its parameters: {wrong.detail}", remedy="Give them with --set NAME=VALUE."
        ) from None
    except UNPROVED as error:
        raise WrongClass(f"{asked.class_path} cannot be made: {complaint(error)}") from error
    new.go_on_from(old)
    return new


def handed_over(old: Implementation, new: Implementation) -> bool:
    """Hand the old implementation's state over to the new one; if the parameters differ, those of the new one count."""
    new.go_on_from(old)
    is_kept = hand_over(old, new)
    given, had = msgspec.to_builtins(new.parameters), msgspec.to_builtins(old.parameters)
    if any(had.get(name, value) != value for name, value in given.items()):
        new.parameters_changed()
    return is_kept
