"""A module is tried in three lines, and its ports are plain data."""

from __future__ import annotations

import sys
import typing
from typing import Annotated, Any

import msgspec
import numpy as np
import pytest
from sample_modules import Counter, Doubler, Follower, Number, Sum, Summing

from mission_control.modules.module import Module, default_name
from mission_control.modules.ports import LATEST, Key, ModulePorts, Port, Ports, WrongDeclaration, ports_of


def test_a_module_is_tried_in_three_lines() -> None:
    module = Counter(Counter.Parameters(step=2.0))
    module.update(Counter.Inputs())
    assert module.update(Counter.Inputs()) == Counter.Outputs(Number(4.0))


def test_after_a_reset_a_module_is_as_it_was_when_it_was_made() -> None:
    module = Counter()
    first = module.update(Counter.Inputs())
    module.reset()
    assert module.update(Counter.Inputs()) == first


def test_ports_are_read_from_the_annotations() -> None:
    number, total = f"{Number.__module__}:Number", f"{Sum.__module__}:Sum"
    assert Follower.ports() == ModulePorts(
        (Port("sum", "sum", total), Port("last", "place", number, is_required=False, is_latest=True)),
        (Port("place", "place", number),),
    )
    assert Summing.ports().outputs == (Port("sum", "sum", total, is_required=False),)
    assert Counter.ports().inputs == ()


class Choice(Ports):
    either: Number | Sum


class BadKey(Ports):
    number: Annotated[Number, Key("Not A Name")]


class Nowhere(Ports):
    missing: NotThere  # type: ignore[name-defined]  # noqa: F821


class HalfWritten(Ports):
    number: Number.NotThere  # type: ignore[name-defined]


class NoPorts:
    number: Number


class MarkInside(Ports):
    number: Annotated[Number, LATEST] | None = None


@pytest.mark.parametrize(
    ("declared", "word"),
    [
        (Choice, "choice"),
        (BadKey, "Not A Name"),
        (Nowhere, "NotThere"),
        (HalfWritten, "HalfWritten: AttributeError: .*NotThere"),
        (NoPorts, "NoPorts declares no ports"),
        (None, "None declares no ports"),
    ],
)
def test_a_declaration_that_cannot_be_read_is_refused(declared: type[Ports], word: str) -> None:
    with pytest.raises(WrongDeclaration, match=word):
        ports_of(declared)


class Undeclared(Module):
    pass


class Awaiting(Module):
    async def update(self, inputs: Any) -> Any:
        return self.Outputs()


class ByPort(Module):
    def update(self, left: Any, right: Any) -> Any:  # type: ignore[override]
        return self.Outputs()


class Bare(Module):
    @staticmethod
    def update(inputs: Any) -> Any:
        return Bare.Outputs()


class NeverReady(Bare):
    async def is_ready(self) -> bool:  # type: ignore[override]
        return True


class UntypedParameter(Bare):
    class Parameters(Module.Parameters, frozen=True):
        weight = 0.25


class UntypedState(Bare):
    class State(Module.State):
        height_m = 0.0


@pytest.mark.parametrize(
    ("kind", "word"),
    [
        (UntypedParameter, "Parameters.weight has no type, so it is no field; write weight: float = 0.25"),
        (UntypedState, "State.height_m has no type, so it is no field; write height_m: float = 0.0"),
        (Undeclared, "update of .*:Undeclared is not declared"),
        (Awaiting, "update of .*:Awaiting is an async function"),
        (ByPort, "update of .*:ByPort: missing a required argument: 'right'"),
        (NeverReady, ".*:NeverReady: is_ready is an 'async def'; write it as a 'def'"),
    ],
)
def test_an_update_that_no_unit_can_call_is_refused_before_the_first_round(kind: type[Module], word: str) -> None:
    with pytest.raises(WrongDeclaration, match=word):
        kind.ports()


def test_an_update_may_need_no_self() -> None:
    assert Bare.ports() == ModulePorts()


class Forgetful(Module):
    class State(Module.State):
        last: float


def test_a_state_without_a_default_is_refused_by_its_name() -> None:
    with pytest.raises(WrongDeclaration, match=r"Forgetful\.State cannot be made: .*last.*Give each field"):
        Forgetful()


def test_a_mark_may_stand_inside_the_choice_of_nothing() -> None:
    assert ports_of(MarkInside) == (
        Port("number", "number", f"{Number.__module__}:Number", is_required=False, is_latest=True),
    )


@pytest.mark.skipif(sys.version_info < (3, 12), reason="Python 3.11 has no aliases that are objects")
def test_a_port_of_an_alias_is_one_of_the_class_that_it_names() -> None:
    alias: Any = getattr(typing, "TypeAliasType")  # noqa: B009  as 'type Just = Number' makes it
    just, latest, perhaps = alias("Just", Number), alias("Latest", Annotated[Number, LATEST]), alias("P", Number | None)
    fields = [("a", just), ("b", latest), ("c", Annotated[perhaps, LATEST], None), ("d", just | None, None)]
    declared = msgspec.defstruct("Declared", fields, bases=(Ports,))
    name = f"{Number.__module__}:Number"
    assert ports_of(declared) == (
        Port("a", "a", name),
        Port("b", "b", name, is_latest=True),
        Port("c", "c", name, is_required=False, is_latest=True),
        Port("d", "d", name, is_required=False),
    )


def test_what_is_shown_costs_nothing_while_nobody_looks_and_is_seen_when_somebody_does() -> None:
    module = Doubler()
    module.debug.picture("never", lambda: pytest.fail("a picture was made"))
    seen: dict[str, object] = {}

    class Looking:
        def picture(self, view: str, make: Any) -> None:
            seen[view] = make()

        def value(self, view: str, value: float | bool | str) -> None:
            seen[view] = value

    module.debug = Looking()
    module.update(Doubler.Inputs(Number(1.0)))
    module.debug.picture("made", lambda: np.zeros(1))
    assert seen == {"factor": 2.0, "made": np.zeros(1)}


def test_the_name_of_a_module_is_its_classs() -> None:
    assert default_name(type("BallModeling2", (Module,), {})) == "ball-modeling2"
