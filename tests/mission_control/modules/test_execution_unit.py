"""Units at work: which modules run in a round, what they are handed, and how it is counted."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Protocol, TypedDict

import msgspec
import numpy as np
import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from sample_modules import Counter, Doubler, Follower, Number, Sum, Summing

from mission_control.modules.execution_unit import AwaitedKeys, ExecutionUnit, ModuleTimes, Produced, UnitStatistics
from mission_control.modules.graph import Graph, Member
from mission_control.modules.module import Module, default_name
from mission_control.modules.orders import WrongModule
from mission_control.modules.ports import LATEST, ports_of, type_name
from mission_control.modules.unit_schedule import OnInput, Trigger
from mission_control.modules.units_together import UnitsTogether

NUMBER = type_name(Number)


def together(
    units: Mapping[str, Sequence[Module]],
    given: Mapping[str, str] | None = None,
    triggers: Mapping[str, Trigger] | None = None,
) -> UnitsTogether:
    """Return units of modules that have the names of their classes."""
    modules = {default_name(type(module)): module for of in units.values() for module in of}
    graph = Graph(
        {unit: [Member(default_name(type(one)), one.ports()) for one in of] for unit, of in units.items()}, given
    )
    return UnitsTogether(graph, modules, triggers, stopwatch=lambda: 0.0)


class Joining(Module):
    """Notes what it gets: two fresh inputs of which one is required, and one latest value."""

    class Inputs(Module.Inputs):
        a: Number
        b: Number | None = None
        newest: Annotated[Number | None, LATEST] = None

    class Outputs(Module.Outputs):
        joined: tuple[Any, ...]

    def update(self, inputs: Inputs) -> Outputs:
        return self.Outputs((inputs.a, inputs.b, inputs.newest))


@given(st.lists(st.sampled_from(["a", "b", "newest"]), max_size=30))
@settings(max_examples=share(200))
def test_a_fresh_value_is_had_once_and_a_latest_value_as_often_as_the_module_runs(comes: list[str]) -> None:
    graph = Graph({"one": [Member("joining", Joining.ports())]}, {"a": NUMBER, "b": NUMBER, "newest": NUMBER})
    unit = ExecutionUnit("one", graph, {"joining": Joining()}, Trigger(), stopwatch=lambda: 0.0)
    newest: dict[str, Number | None] = {"a": None, "b": None, "newest": None}
    for number, key in enumerate(comes):
        value = newest[key] = Number(float(number))
        is_due = unit.put(key, value)
        assert is_due == (key == "a"), "only the required fresh input begins a round"
        if is_due:
            [(_, joined)] = unit.run(float(number))
            assert joined == (newest["a"], newest["b"], newest["newest"])
            newest["a"] = newest["b"] = None


def test_a_unit_names_the_inputs_that_a_module_waits_for() -> None:
    graph = Graph({"one": [Member("joining", Joining.ports())]}, {"a": NUMBER, "b": NUMBER, "newest": NUMBER})
    unit = ExecutionUnit("one", graph, {"joining": Joining()}, Trigger(), stopwatch=lambda: 0.0)
    unit.put("b", Number(1.0))
    assert unit.waits("joining") == AwaitedKeys(0, {"a": False}, needs_all=True)
    unit.put("a", Number(1.0))
    assert unit.waits("joining") == AwaitedKeys(0, {}, needs_all=False)
    unit.run(0.0)
    assert unit.waits("joining") == AwaitedKeys(1, {"a": True}, needs_all=True)
    assert unit.waits("nobody") is None


def test_a_module_with_optional_fresh_inputs_waits_for_one_of_them() -> None:
    class Either(Module):
        class Inputs(Module.Inputs):
            a: Number | None = None
            b: Number | None = None

        def update(self, inputs: Module.Inputs) -> Module.Outputs:
            return self.Outputs()

    graph = Graph({"one": [Member("either", Either.ports())]}, {"a": NUMBER, "b": NUMBER})
    unit = ExecutionUnit("one", graph, {"either": Either()}, Trigger(), stopwatch=lambda: 0.0)
    assert unit.waits("either") == AwaitedKeys(0, {"a": False, "b": False}, needs_all=False)


def test_a_required_input_that_has_not_come_keeps_a_module_waiting_and_then_it_joins() -> None:
    units = together({"one": [Pair()]}, {"left": NUMBER, "right": NUMBER})
    seen: list[Any] = []
    units.listen("pair", seen.append)
    for key, value in [("left", 1.0), ("left", 2.0), ("right", 3.0), ("right", 4.0), ("left", 5.0)]:
        units.feed(key, Number(value), 0.0)
    assert seen == [(2.0, 3.0), (5.0, 4.0)]
    assert units.statistics()["one"].overwritten == {"left": 1}


class Pair(Module):
    class Inputs(Module.Inputs):
        left: Number
        right: Number

    class Outputs(Module.Outputs):
        pair: tuple[Any, ...]

    def update(self, inputs: Inputs) -> Outputs:
        return self.Outputs((inputs.left.value, inputs.right.value))


class Picture(Module):
    """Makes a large array."""

    class Outputs(Module.Outputs):
        picture: NDArray[Any]

    def update(self, inputs: Module.Inputs) -> Outputs:
        return self.Outputs(np.zeros((2000, 1250, 4), np.uint8))


class Brightness(Module):
    """Keeps what it got, to be compared."""

    class Inputs(Module.Inputs):
        picture: NDArray[Any]

    class Outputs(Module.Outputs):
        same: NDArray[Any]

    def update(self, inputs: Inputs) -> Outputs:
        return self.Outputs(inputs.picture)


@pytest.mark.parametrize("cut", [{"one": [Picture, Brightness]}, {"one": [Picture], "two": [Brightness]}])
def test_in_one_process_the_object_itself_is_handed_over(cut: Mapping[str, list[type[Module]]]) -> None:
    """RoboFrame 2006, section III: even very large messages without any overhead in one thread."""
    units = together({unit: [kind() for kind in kinds] for unit, kinds in cut.items()}, triggers={"one": Trigger(1.0)})
    made: list[Any] = []
    units.listen("picture", made.append)
    units.listen("same", made.append)
    units.advance(0.0)
    assert len(made) == 2
    assert made[0] is made[1]
    assert made[0].nbytes == 10_000_000


ARRANGEMENTS = [
    {"one": ["counter", "doubler", "summing", "follower"]},
    {"one": ["follower", "summing"], "two": ["doubler", "counter"]},
    {"a": ["counter"], "b": ["doubler"], "c": ["summing"], "d": ["follower"]},
]


@pytest.mark.parametrize("arrangement", ARRANGEMENTS)
def test_the_same_modules_say_the_same_in_every_arrangement(arrangement: Mapping[str, list[str]]) -> None:
    kinds = {default_name(kind): kind for kind in (Counter, Doubler, Summing, Follower)}
    counting = next(unit for unit, of in arrangement.items() if "counter" in of)
    units = together(
        {unit: [kinds[name]() for name in of] for unit, of in arrangement.items()},
        triggers={counting: Trigger(10.0)},
    )
    sums: list[Sum] = []
    places: list[Number] = []
    units.listen("sum", sums.append)
    units.listen("place", places.append)
    units.advance(0.95)
    assert [one.value for one in sums] == [6.0, 20.0, 42.0, 72.0, 110.0]
    assert places == [Number(p) for p in itertools.accumulate([3.0, 10.0, 21.0, 36.0, 55.0], lambda a, b: a / 2 + b)]
    assert {name: one.rounds for name, one in units.statistics().items()}[counting] == 10


@given(
    st.lists(st.tuples(st.sampled_from(["left", "right"]), st.integers(0, 9)), max_size=20),
    st.sampled_from([Trigger(), Trigger(on_input=OnInput.ALL), Trigger(4.0), Trigger(3.0, OnInput.NONE)]),
)
@settings(max_examples=share(100))
def test_two_runs_of_the_same_inputs_are_the_same(comes: list[tuple[str, int]], trigger: Trigger) -> None:
    graph = Graph(
        {"one": [Member("pair", Pair.ports()), Member("counter", Counter.ports())]}, {"left": NUMBER, "right": NUMBER}
    )

    def played() -> tuple[list[Produced], UnitStatistics]:
        unit = ExecutionUnit("one", graph, {"pair": Pair(), "counter": Counter()}, trigger, stopwatch=lambda: 0.0)
        produced = []
        for number, (key, value) in enumerate(comes):
            if unit.put(key, Number(float(value))):
                produced += unit.run(number / 10)
            if unit.tick(number / 10):
                produced += unit.run(number / 10)
        return produced, unit.statistics()

    assert played() == played()


def test_what_a_module_costs_is_counted_for_itself() -> None:
    watch = iter([0.0, 1.0, 1.0, 4.0, 10.0, 12.0, 12.0, 13.0])
    graph = Graph({"one": [Member("counter", Counter.ports()), Member("doubler", Doubler.ports())]})
    modules = {"counter": Counter(), "doubler": Doubler()}
    unit = ExecutionUnit("one", graph, modules, Trigger(2.0), stopwatch=lambda: next(watch))
    for now_s in (0.0, 1.3):
        assert unit.tick(now_s)
        unit.run(now_s)
    counted = unit.statistics()
    assert counted.modules == {"counter": ModuleTimes(2, 3.0, 2.0), "doubler": ModuleTimes(2, 4.0, 3.0)}
    assert (counted.rounds, counted.ticks, counted.missed) == (2, 2, 1)
    assert counted.most_late_s == pytest.approx(0.8)


def test_a_class_of_ports_is_read_once() -> None:
    assert ports_of(Pair.Inputs) is ports_of(Pair.Inputs)


class Rounded(Number, frozen=True):
    """A message of its own on the bus, which a reader of ``Number`` refuses."""


class Faulty(Module):
    """Returns what it is given, or raises it."""

    class Outputs(Module.Outputs):
        number: Number

    def __init__(self, returned: object) -> None:
        super().__init__()
        self.returned = returned

    def update(self, inputs: Module.Inputs) -> Any:
        if isinstance(self.returned, BaseException):
            raise self.returned
        return self.returned


@pytest.mark.parametrize(
    ("returned", "told"),
    [
        (None, r"returned builtins:NoneType, not its Outputs \(.*test_execution_unit.py, line \d+\)"),
        ({"number": Number(1.0)}, "not its Outputs"),
        (Faulty.Outputs("text"), "update of faulty returned builtins:str as number, not"),  # type: ignore[arg-type]
        (Faulty.Outputs(Trigger(1.0)), "Trigger as number, not"),  # type: ignore[arg-type]
        (Faulty.Outputs(Rounded(1.0)), "Rounded as number, not sample_modules:Number"),
        (Faulty.Outputs(None), "update of faulty returned None as number, which each round must have"),  # type: ignore[arg-type]
        (asyncio.CancelledError(), "update of faulty raised CancelledError"),
        (StopIteration(), r"update of faulty raised StopIteration: \(.*test_execution_unit.py, line"),
    ],
)
def test_what_is_no_output_goes_to_nobody_and_is_a_bug_with_the_name_of_its_module(returned: object, told: str) -> None:
    graph = Graph({"one": [Member("faulty", Faulty.ports())]}, {})
    unit = ExecutionUnit("one", graph, {"faulty": Faulty(returned)}, Trigger(1.0), stopwatch=lambda: 0.0)
    with pytest.raises((RuntimeError, WrongModule), match=told):
        unit.run(0.0)


class Valued(Protocol):
    value: float


class Record(TypedDict):
    value: float


@pytest.mark.parametrize("kind", [Any, Valued, Record], ids=str)
def test_a_port_may_have_a_class_with_which_no_value_can_be_compared(kind: Any) -> None:
    outputs, value = msgspec.defstruct("Outputs", [("it", kind)], bases=(Module.Outputs,)), {"value": 1.0}

    class Free(Module):
        Outputs = outputs  # type: ignore[assignment]

        def update(self, inputs: Module.Inputs) -> Any:
            return outputs(value)

    graph = Graph({"one": [Member("free", Free.ports())]}, {})
    unit = ExecutionUnit("one", graph, {"free": Free()}, Trigger(1.0), stopwatch=lambda: 0.0)
    assert unit.run(0.0) == [("it", value)]
