"""A class is refused before its start if its methods cannot be called like those of its base class."""

from __future__ import annotations

from collections.abc import Coroutine, Mapping, Sequence
from typing import Any, ClassVar

import pytest

from backbone.bus.interface import Bus, Clock
from backbone.component.class_faults import class_faults
from backbone.component.class_path import WrongClassPath, load_class
from backbone.component.component import Component, NoParameters
from backbone.component.launch import Launch
from backbone.component.messages import AskState
from backbone.mission.class_facts import shipped_classes
from backbone.mission.class_probe import facts_of
from backbone.shipped import is_shipped
from backbone.wire import Envelope, Message
from mission_control.behavior import Behavior, BehaviorParameters
from mission_control.children import Children
from resource_pool.arc_client import Frame
from resource_pool.commands import Command
from resource_pool.holds import Hold
from resource_pool.resource_controller import RcParameters, ResourceController


class Quiet(Behavior[BehaviorParameters]):
    def see(self, frame: Frame) -> None:
        pass


class Unseeing(Quiet):
    async def see(self, frame: Frame) -> None:  # type: ignore[override]
        pass


class Unawaited(Quiet):
    def act(self) -> None:  # type: ignore[override]
        pass


class Passing(Quiet):
    def act(self) -> Coroutine[Any, Any, None]:
        return super().act()

    async def resumed(self, rcs: Mapping[str, str], more: int = 0) -> None:
        pass


class Short(Quiet):
    async def suspended(self, reason: str) -> None:  # type: ignore[override]
        pass


class Misspelt(Quiet):
    async def suspendig(self, deadline_s: float) -> None:
        pass


class Doubled(Quiet):
    async def actt(self) -> None:
        pass


class Swapped(Quiet):
    async def satrt(self) -> None:
        pass


class Dropped(Quiet):
    def rles(self, children: Sequence[str]) -> Children:
        return Children(children)


class Helped(Quiet):
    """Its names are a letter away from hooks, and used."""

    async def start(self) -> None:
        self.stat()
        Helped.cat()

    def stat(self) -> None:
        pass

    @staticmethod
    def cat() -> None:
        pass


class Similar(Quiet):
    """Its names are other words than the hooks."""

    def seek(self) -> None:
        pass

    def fact(self) -> None:
        pass

    def resume(self) -> None:
        pass


class Dangerous(ResourceController[RcParameters]):
    async def make_save(self, hold: Hold) -> None:
        pass


class Spelt(Misspelt):
    async def suspending(self, deadline_s: float) -> None:
        pass

    async def suspended_by(self) -> None:
        pass


class Forgetful(Quiet):
    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        self.count = 0


class Simple(Quiet):
    def __init__(self) -> None:
        super().__init__()  # type: ignore[call-arg]


class Unanswering(Component[NoParameters]):
    accepts = AskState

    async def handle(self, asked: Envelope[Message]) -> Message:
        return asked.body


class Answering(Unanswering):
    async def answer(self, asked: Envelope[Message]) -> Message:
        return asked.body


class Careful(Quiet):
    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        Quiet.__init__(self, launch, bus, clock)


class Heir(Forgetful):
    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)


RENAME = "which is not overridden; write {}, or a less similar name"
FORGOTTEN = "__init__ of Forgetful does not call super().__init__; call it first, with the same arguments"


class Speed(BehaviorParameters, frozen=True):
    speed_m_s: float = 0.1


class Untyped(BehaviorParameters, frozen=True):
    speed_m_s = 0.1
    _unit = "m/s"
    MOST_M_S = 0.5
    least_m_s: ClassVar[float] = 0.0


class Hasty(Behavior[Untyped]):
    parameters_type = Untyped


class Blink(Command, frozen=True):
    times = 3
    moves = True


class Blinker(ResourceController[RcParameters]):
    commands = Blink

    async def obey(self, hold: Hold, order: Command) -> Mapping[str, float]:
        return {}


class Unread(Behavior[Speed]):
    pass


class Read(Behavior[Speed]):
    parameters_type = Speed


@pytest.mark.parametrize(
    ("kind", "fault"),
    [
        (
            Simple,
            "__init__: too many positional arguments; the base class has __init__(self, launch, bus, clock)",
        ),
        (Unseeing, "see is an 'async def'; write it as a 'def', as the base class does"),
        (Unawaited, "act is a 'def'; write it as an 'async def', as the base class does"),
        (Short, "suspended: too many positional arguments; the base class has suspended(self, reason, by)"),
        (Misspelt, "suspendig looks like suspending misspelt, " + RENAME.format("suspending")),
        (Doubled, "actt looks like act misspelt, " + RENAME.format("act")),
        (Swapped, "satrt looks like start misspelt, " + RENAME.format("start")),
        (Dropped, "rles looks like rules misspelt, " + RENAME.format("rules")),
        (Dangerous, "make_save looks like make_safe misspelt, " + RENAME.format("make_safe")),
        (
            Unanswering,
            "accepts has AskState, and no answer replies; write 'async def answer(self, asked)'",
        ),
        (Forgetful, FORGOTTEN),
        (Heir, FORGOTTEN),
        (Hasty, "Untyped.speed_m_s has no type, so it is no field; write speed_m_s: float = 0.1"),
        (Unread, "it has Speed in brackets and reads BehaviorParameters; write 'parameters_type = Speed' in it"),
    ],
)
def test_a_class_that_cannot_work_is_refused_by_check_at_its_start_and_by_swap(kind: type, fault: str) -> None:
    assert list(class_faults(kind)) == [fault]
    class_path = f"{kind.__module__}:{kind.__name__}"
    assert facts_of(class_path).failure == fault
    with pytest.raises(WrongClassPath, match="Mend the class"):
        load_class(class_path)


def test_a_command_with_a_field_without_a_type_is_refused_by_check() -> None:
    assert facts_of(f"{__name__}:Blinker").failure == "Blink.times has no type, so it is no field; write times: int = 3"


@pytest.mark.parametrize("kind", [Quiet, Passing, Read, Careful, Spelt, Similar, Helped, Answering])
def test_a_class_that_can_work_has_no_fault(kind: type) -> None:
    assert list(class_faults(kind)) == []


@pytest.mark.parametrize("class_path", sorted(shipped_classes()))
def test_no_shipped_class_has_a_fault(class_path: str) -> None:
    """Their starts do not judge them."""
    assert is_shipped(class_path)
    assert list(class_faults(load_class(class_path))) == []
