"""Laws of an exchange: each round has the outputs of one module, state is kept, the old one comes back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from threading import Lock
from typing import Any

import msgspec
import numpy as np
import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from sample_modules import Number

from backbone.errors import complaint
from backbone.exchange import Swapped
from backbone.exchange_course import ExchangePhase, ExchangeRules
from backbone.ranges import LONGEST_LINE
from backbone.wire import WIRE_VERSION, Envelope, Reader, write
from mission_control.modules.exchange import Exchange, Turned, handed_over
from mission_control.modules.exchangeable import judge_of, kinds_made
from mission_control.modules.execution_unit import ExecutionUnit, WantedExchange
from mission_control.modules.graph import Graph, Member
from mission_control.modules.module import Module
from mission_control.modules.ports import type_name
from mission_control.modules.unit_schedule import Trigger

ROUND_S = 0.1


class Tally(Module):
    """Says who it is, the number of its updates, and the sum of all it got."""

    class Inputs(Module.Inputs):
        number: Number

    class Outputs(Module.Outputs):
        tally: tuple[Any, ...] | None = None

    class State(Module.State):
        updates: int = 0
        got: list[float] = []

    class Parameters(Module.Parameters, frozen=True):
        who: str = "old"
        fails_at: int = -1
        silent_from: int = -1
        ready_after: int = 0

    state: State
    parameters: Parameters

    def reset(self) -> None:
        super().reset()
        self.runs = 0

    def is_ready(self) -> bool:
        return self.runs >= self.parameters.ready_after

    def update(self, inputs: Inputs) -> Outputs:
        given = self.parameters
        if self.runs == given.fails_at:
            raise ValueError("planted")
        self.runs += 1
        self.state.updates += 1
        self.state.got.append(inputs.number.value)
        if 0 <= given.silent_from < self.runs:
            return self.Outputs()
        return self.Outputs((given.who, self.state.updates, sum(self.state.got)))


class Stateless(Tally):
    """Another one, which declares another state."""

    class State(Module.State):
        updates: int = 0
        got: list[float] = []
        more: str = ""


MEMBER = Member("tally", Tally.ports())
KINDS = kinds_made(Tally, MEMBER)
GRAPH = Graph({"one": [MEMBER]}, {"number": type_name(Number)})


def unit_of(module: Module) -> ExecutionUnit:
    return ExecutionUnit("one", GRAPH, {"tally": module}, Trigger(), stopwatch=lambda: 0.0)


@dataclass
class Swap:
    """An exchange that begins with this round."""

    at: int
    new: Tally
    rules: ExchangeRules


def swaps(new: st.SearchStrategy[Tally]) -> st.SearchStrategy[list[Swap]]:
    rules = st.builds(
        ExchangeRules,
        prove_s=st.sampled_from([0.0, 0.25, 0.5, 2.0]),
        ready_within_s=st.sampled_from([0.15, 1.0]),
        silent_s=st.sampled_from([0.0, 0.25]),
    )
    return st.lists(st.builds(Swap, at=st.integers(0, 30), new=new, rules=rules), max_size=4)


def tallies(**fields: st.SearchStrategy[Any]) -> st.SearchStrategy[Tally]:
    return st.builds(lambda **given: Tally(Tally.Parameters(who="new", **given)), **fields)


ANY = tallies(
    fails_at=st.sampled_from([-1, -1, 0, 1, 2, 5]),
    silent_from=st.sampled_from([-1, -1, 0, 1, 3]),
    ready_after=st.integers(0, 4),
)
EQUAL = tallies(ready_after=st.integers(0, 4))


def played(numbers: Sequence[float], wanted: Sequence[Swap]) -> tuple[list[list[Any]], list[Exchange]]:
    """Return what each round produced, and the exchanges that began."""
    unit, said, began = unit_of(Tally()), list[list[Any]](), list[Exchange]()
    for number, value in enumerate(numbers):
        now_s = number * ROUND_S
        for one in wanted:
            if one.at == number and (not began or began[-1].is_over):
                exchange = Exchange(one.rules, one.new.is_ready, lambda: None, now_s)
                judge = judge_of(KINDS, Tally, MEMBER)
                unit.exchange(WantedExchange(GRAPH, "tally", one.new, exchange, judge))
                began.append(exchange)
        assert unit.put("number", Number(value))
        try:
            said.append([value for _key, value in unit.run(now_s)])
        except ValueError:  # a module that has proved itself fails: as without an exchange, the unit ends
            assert any(one.phase is ExchangePhase.PROVED for one in began)
            break
    return said, began


NUMBERS = st.lists(st.integers(0, 9).map(float), min_size=1, max_size=40)


@given(NUMBERS, swaps(ANY))
@settings(max_examples=share(300))
def test_each_round_has_the_outputs_of_one_module_and_only_a_silent_new_one_leaves_a_round_without(
    numbers: list[float], wanted: list[Swap]
) -> None:
    said, began = played(numbers, wanted)
    for produced in said:
        assert len(produced) <= 1
    silences = sum(produced == [] for produced in said)
    if all(one.new.parameters.silent_from < 0 for one in wanted):
        assert silences == 0
        updates = [produced[0][1] for produced in said]
        sums = [produced[0][2] for produced in said]
        assert updates == list(range(1, len(said) + 1)), "none lost, none doubled, whoever produced"
        assert sums == [sum(numbers[: n + 1]) for n in range(len(said))]  # fewer if a proved module failed
    for exchange in began:
        assert not (exchange.phase is ExchangePhase.RETURNED and not exchange.cause)


@given(NUMBERS, swaps(EQUAL))
@settings(max_examples=share(300))
def test_exchanges_between_equal_classes_change_no_output(numbers: list[float], wanted: list[Swap]) -> None:
    said, _began = played(numbers, wanted)
    plain, _none = played(numbers, [])
    assert [[one[1:] for one in produced] for produced in said] == [[one[1:] for one in produced] for produced in plain]


@given(NUMBERS, st.integers(0, 20), tallies(fails_at=st.integers(0, 6), ready_after=st.integers(0, 9)))
@settings(max_examples=share(200))
def test_after_a_failure_all_is_as_if_there_had_been_no_exchange(numbers: list[float], at: int, new: Tally) -> None:
    said, began = played(numbers, [Swap(at, new, ExchangeRules(1e9, 1e9, 1e9))])
    plain, _none = played(numbers, [])
    if began and began[0].phase is ExchangePhase.RETURNED:
        assert "ValueError: planted" in began[0].cause
        assert began[0].ended_s is not None
        ended = round(began[0].ended_s / ROUND_S)
        assert said[ended:] == plain[ended:], "from the very round of the failure on"


def rounds_of(exchange: Exchange, *, old: Turned, new: Turned, count: int, first_s: float = 0.0) -> list[Turned]:
    return [exchange.round(first_s + n * ROUND_S, lambda: old, lambda: new) for n in range(count)]


def begun(prove_s: float = 1.0, ready_within_s: float = 1.0, silent_s: float = 0.25) -> Exchange:
    return Exchange(ExchangeRules(prove_s, ready_within_s, silent_s), lambda: True, lambda: None, 0.0)


def test_a_new_one_that_says_nothing_is_not_ready_while_the_old_one_speaks() -> None:
    exchange = begun()
    assert rounds_of(exchange, old={"a": 1}, new={}, count=11) == [{"a": 1}] * 11
    assert (exchange.phase, exchange.switched_s) == (ExchangePhase.RETURNED, None)
    assert exchange.cause == "not ready within 1 s"


def test_a_new_one_that_falls_silent_gives_its_place_back_in_that_very_round() -> None:
    exchange = begun()
    rounds_of(exchange, old={"a": 1}, new={"a": 2}, count=2)
    assert exchange.phase is ExchangePhase.PROVING
    assert rounds_of(exchange, old={"a": 1}, new={}, count=4, first_s=0.2) == [{}, {}, {}, {"a": 1}]
    assert exchange.phase is ExchangePhase.RETURNED
    assert exchange.cause == "no a for 0.25 s, and the old one had it"


def test_without_a_time_to_prove_itself_the_new_one_is_alone_after_the_switch() -> None:
    exchange = begun(prove_s=0.0)
    assert rounds_of(exchange, old={"a": 1}, new={"a": 2}, count=2) == [{"a": 1}, {"a": 2}]
    assert (exchange.phase, exchange.switched_s, exchange.ended_s) == (ExchangePhase.PROVED, 0.0, 0.0)


def test_time_passes_without_rounds() -> None:
    exchange = begun()
    exchange.pass_time(0.5)
    assert exchange.phase is ExchangePhase.WARMING
    exchange.pass_time(1.0)
    assert exchange.cause == "not ready within 1 s: its unit had no round"


def test_what_a_new_one_lacked_is_named() -> None:
    """A unit that stands still, or of 0.01 Hz, has no round at all; only in a round inputs can be missing."""
    exchange = begun()
    assert exchange.round(0.5, lambda: None, lambda: None) is None
    exchange.pass_time(1.0)
    assert exchange.cause == "not ready within 1 s: its inputs did not come together"


def test_an_old_one_that_fails_beside_the_new_one_is_gone_and_the_unit_goes_on() -> None:
    def broken() -> Turned:
        raise RuntimeError("old age")

    exchange = begun()
    rounds_of(exchange, old={"a": 1}, new={"a": 2}, count=1)
    assert exchange.round(0.1, broken, lambda: {"a": 2}) == {"a": 2}
    assert exchange.phase is ExchangePhase.PROVED
    assert "the old one failed beside it and is gone: RuntimeError: old age" in exchange.cause
    with pytest.raises(RuntimeError, match="old age"):
        begun().round(0.0, broken, lambda: {"a": 2})


def test_two_that_fail_in_the_same_round_are_the_bug_of_the_old_one() -> None:
    def broken() -> Turned:
        raise RuntimeError("both")

    exchange = begun()
    rounds_of(exchange, old={"a": 1}, new={"a": 2}, count=1)
    with pytest.raises(RuntimeError, match="both"):
        exchange.round(0.1, broken, broken)


@pytest.mark.parametrize("ending", [SystemExit(3), KeyboardInterrupt()], ids=repr)
def test_a_module_that_ends_the_process_only_ends_its_exchange(ending: BaseException) -> None:
    def leaving() -> Turned:
        raise ending

    exchange = begun()
    assert exchange.round(0.0, lambda: {"a": 1}, leaving) == {"a": 1}
    assert exchange.cause.startswith(type(ending).__name__)


@pytest.mark.parametrize("ending", [SystemExit(3), KeyboardInterrupt(), ValueError()], ids=repr)
def test_an_old_one_that_ends_the_process_only_ends_the_exchange(ending: BaseException) -> None:
    def leaving() -> Turned:
        raise ending

    exchange = begun()
    rounds_of(exchange, old={"a": 1}, new={"a": 2}, count=1)
    assert exchange.round(0.1, leaving, lambda: {"a": 2}) == {"a": 2}
    assert exchange.phase is ExchangePhase.PROVED


def test_an_answer_that_is_neither_ready_nor_not_ends_the_exchange() -> None:
    exchange = Exchange(ExchangeRules(1.0, 1.0), lambda: np.array([True, False]), lambda: None, 0.0)  # type: ignore[arg-type, return-value]
    assert exchange.round(0.0, lambda: {"a": 1}, lambda: {"a": 2}) == {"a": 1}
    assert exchange.cause.startswith("ValueError: The truth value of an array")


def test_state_is_copied_because_both_run() -> None:
    old, new = Tally(), Tally()
    old.update(old.Inputs(Number(1.0)))
    assert handed_over(old, new)
    new.update(new.Inputs(Number(2.0)))
    assert (old.state.got, new.state.got) == ([1.0], [1.0, 2.0])


def test_two_fields_of_a_state_share_an_object_after_the_exchange_too() -> None:
    class Tracks(Module):
        class State(Module.State):
            every: list[list[float]] = []
            best: list[float] = []

    old, new = Tracks(), Tracks()
    old.state.every = [old.state.best]
    assert handed_over(old, new)
    assert new.state.every[0] is new.state.best
    assert new.state.best is not old.state.best


def test_another_state_is_not_handed_over() -> None:
    old, new = Tally(), Stateless()
    old.update(old.Inputs(Number(1.0)))
    assert not handed_over(old, new)
    assert new.state.updates == 0


def test_a_module_without_a_state_begins_with_reset() -> None:
    class Plain(Module):
        pass

    assert not handed_over(Plain(), Plain())


@pytest.mark.parametrize("returned", [None, 3, Module.Outputs()])
def test_what_is_no_outputs_ends_the_exchange_with_its_class(returned: object) -> None:
    class Wrong(Tally):
        def update(self, inputs: Any) -> Any:
            return returned

    unit, new = unit_of(Tally()), Wrong()
    exchange = begun()
    unit.exchange(WantedExchange(GRAPH, "tally", new, exchange, judge_of(KINDS, Wrong, MEMBER)))
    unit.put("number", Number(1.0))
    assert [value for _key, value in unit.run(0.0)] == [("old", 1, 1.0)]
    assert type(returned).__name__ in exchange.cause
    assert "not its Outputs" in exchange.cause


def test_a_complaint_names_the_line() -> None:
    with pytest.raises(msgspec.DecodeError) as raised:
        msgspec.json.decode(b"{")
    assert f"{__file__}, line " in complaint(raised.value)


def test_a_complaint_can_be_sent_whatever_the_exception_says() -> None:
    told = complaint(ValueError("caf\udce9 \x1b[2J" + "x" * 300_000))
    assert told.startswith(r"ValueError: caf\udce9 \x1b[2Jxxx")
    assert len(told) < LONGEST_LINE


def test_the_answer_can_be_sent_although_the_round_is_older_than_the_request() -> None:
    old = Tally()
    old.state.got = Lock()  # type: ignore[assignment]  # it cannot be copied
    unit, exchange = unit_of(old), Exchange(ExchangeRules(1.0, 1.0), lambda: True, lambda: None, 10.5)
    unit.exchange(WantedExchange(GRAPH, "tally", Tally(), exchange, lambda _outputs: None))
    unit.run(10.0)  # it began at 10.0 and ends after the request
    assert "cannot pickle" in exchange.cause
    told = exchange.answer(11.0)
    sent = write(Envelope(WIRE_VERSION, "kit/kit", 0, 0.0, "", told))
    assert Reader(Swapped).read(sent).body == told


def test_the_new_one_does_not_get_what_the_old_one_has_had() -> None:
    unit, new, exchange = unit_of(Tally()), Tally(), begun()
    unit.put("number", Number(1.0))
    unit.run(0.0)
    unit.exchange(WantedExchange(GRAPH, "tally", new, exchange, lambda _outputs: None))
    assert unit.run(0.1) == []
    assert (new.runs, new.state.got) == (0, [1.0]), "the state was handed over, and no input"


def test_an_exchange_overwrites_no_value() -> None:
    unit, new, exchange = unit_of(Tally()), Tally(), begun(prove_s=0.2)
    unit.exchange(WantedExchange(GRAPH, "tally", new, exchange, lambda _outputs: None))
    for number in range(10):
        unit.put("number", Number(float(number)))
        unit.run(number * ROUND_S)
    assert exchange.phase is ExchangePhase.PROVED
    assert unit.statistics().overwritten == {}
