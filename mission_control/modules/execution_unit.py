"""Execution unit: modules that run one after the other, round by round, and exchange objects without copying.

Pure: time is an argument, and the caller carries values between units. In a round each module runs, in the graph's
order, if no input is missing:

* a required input needs a value; a fresh input needs a value that the module has not had yet;
* a module whose fresh inputs are all optional runs if one of them has a new value;
* a module without fresh inputs runs in every round.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import msgspec

from backbone.errors import Refusal, complaint
from backbone.exchange_course import UNPROVED, ExchangePhase
from mission_control.modules.exchange import Exchange, handed_over
from mission_control.modules.exchangeable import judge_of, kinds_made
from mission_control.modules.graph import Graph, Member
from mission_control.modules.module import Module
from mission_control.modules.ports import Port
from mission_control.modules.unit_schedule import Trigger, UnitSchedule

Stopwatch = Callable[[], float]
"""Returns seconds from any origin, to measure the run time of modules."""


class NeverRuns(Refusal):
    """A unit that could never have a round."""

    code = "module.never"
    remedy = "Give the unit a frequency."


class Produced(NamedTuple):
    """A value that a module of the unit has produced."""

    key: str
    value: object


class ModuleTimes(msgspec.Struct, frozen=True):
    """Number and duration of a module's runs."""

    runs: int = 0
    busy_s: float = 0.0
    longest_s: float = 0.0

    def with_run(self, duration_s: float) -> ModuleTimes:
        """Return the times after one more run."""
        return ModuleTimes(self.runs + 1, self.busy_s + duration_s, max(self.longest_s, duration_s))


class UnitStatistics(msgspec.Struct, frozen=True):
    """Statistics of a unit.

    Attributes:
        rounds: Number of rounds.
        rate_hz: Recent rate of rounds, Hz; it falls while no round begins.
        ticks: Rounds that the frequency began.
        missed: Ticks without a round, because an earlier round was too late.
        mean_late_s: Mean delay of the rounds of the frequency.
        most_late_s: Largest of these delays.
        overwritten: Key → number of values from outside that replaced a value not yet taken; for fresh inputs.
        modules: Module → number and duration of its runs.
    """

    rounds: int
    rate_hz: float
    ticks: int
    missed: int
    mean_late_s: float
    most_late_s: float
    overwritten: dict[str, int]
    modules: dict[str, ModuleTimes]


@dataclass(slots=True)
class _Slot:
    """The newest value of a key; ``number`` grows with each."""

    value: object = None
    number: int = 0

    def put(self, value: object) -> None:
        self.value, self.number = value, self.number + 1


@dataclass(slots=True)
class _Input:
    port: Port
    key: str
    slot: _Slot
    seen: int = 0

    @property
    def is_there(self) -> bool:
        return self.slot.number > (0 if self.port.is_latest else self.seen)


@dataclass(slots=True)
class _Seat:
    """A module with its connections."""

    name: str
    module: Module
    inputs: list[_Input]
    outputs: list[tuple[str, str]]
    judge: Callable[[object], None]
    """Raises if what ``update`` returned are no outputs: others would get it as it is."""
    times: ModuleTimes = field(default_factory=ModuleTimes)

    def lacks(self) -> list[_Input]:
        """Return the inputs that the module waits for: all missing required ones, else the fresh ones if none is there.

        The module runs if the list is empty.
        """
        if missing := [one for one in self.inputs if one.port.is_required and not one.is_there]:
            return missing
        fresh = [one for one in self.inputs if not one.port.is_latest]
        return [] if any(one.is_there for one in fresh) else fresh

    def taken(self) -> dict[str, object] | None:
        """Return the present inputs and mark them as seen; None: the module does not run."""
        if self.lacks():
            return None
        given = {one.port.name: one.slot.value for one in self.inputs if one.is_there}
        for one in self.inputs:
            one.seen = one.slot.number
        return given

    def values(self, outputs: object) -> dict[str, object]:
        """Return key → value of what is in the outputs."""
        self.judge(outputs)
        return {key: value for name, key in self.outputs if (value := getattr(outputs, name)) is not None}


class AwaitedKeys(NamedTuple):
    """What a module waits for.

    Attributes:
        keys: Key → True if the module has had an earlier value; empty: it runs in the next round.
        needs_all: True: it needs all of them; False: one is enough.
    """

    runs: int
    keys: dict[str, bool]
    needs_all: bool


class Computing(NamedTuple):
    """A module whose ``update`` runs, in the round of this time."""

    module: str
    round_s: float


@dataclass(frozen=True, slots=True)
class WantedExchange:
    """A request to replace a module by another one.

    Attributes:
        graph: The unit's graph with the new module in place of the old one; its connections from outside are the same.
        name: Name of both modules.
        module: The new one.
        judge: Raises if the new module's ``update`` returned wrong outputs.
    """

    graph: Graph
    name: str
    module: Module
    exchange: Exchange
    judge: Callable[[object], None]


@dataclass(slots=True)
class _Exchanging:
    """Two seats of one name; the exchange decides which one produces."""

    exchange: Exchange
    old: _Seat
    new: _Seat
    seats: list[_Seat]
    """All previous seats of the unit."""


class ExecutionUnit:
    """The modules of one unit at work.

    Args:
        modules: Name → module, for at least all modules of the unit.
        trigger: Condition for rounds.
        start_s: Time of its first tick.
        stopwatch: Measures how long each module runs.

    Attributes:
        computing: The module whose ``update`` runs, and the time of its round, a new object for each run; None: none.

    Raises:
        NeverRuns: The unit has neither a frequency nor an input that begins a round.
    """

    def __init__(
        self,
        name: str,
        graph: Graph,
        modules: Mapping[str, Module],
        trigger: Trigger,
        start_s: float = 0.0,
        stopwatch: Stopwatch = time.perf_counter,
    ) -> None:
        self.name, self._trigger, self._stopwatch = name, trigger, stopwatch
        self._slots: dict[str, _Slot] = {}
        members = {member.name: member for member in graph.units[name]}
        self._seats = [self._seat(members[one], modules[one]) for one in graph.order[name]]
        self._into, self._awaited = frozenset(graph.into(name)), graph.awaited(name)
        if not (trigger.frequency_hz or self._awaited):
            raise NeverRuns(f"unit {name} has no frequency, and no fresh input from outside begins a round")
        self._fresh = self._fresh_inputs()
        self._exchanging: _Exchanging | None = None
        self._wanted: WantedExchange | None = None
        self.computing: Computing | None = None
        self._begin(start_s)

    def _fresh_inputs(self) -> dict[str, list[_Input]]:
        """Return key from outside → the fresh inputs that take its values."""
        every = [one for seat in self._seats for one in seat.inputs if not one.port.is_latest]
        return {key: [one for one in every if one.slot is self._slots[key]] for key in self._into}

    def _begin(self, start_s: float) -> None:
        self._schedule = UnitSchedule(self._trigger, self._awaited, start_s)
        self._overwritten: dict[str, int] = {}

    def _seat(self, member: Member, module: Module) -> _Seat:
        inputs = [_Input(port, key, self._slot(key)) for key, port in member.keyed_inputs]
        outputs = [(port.name, key) for key, port in member.keyed_outputs]
        for _name, key in outputs:
            self._slot(key)
        return _Seat(member.name, module, inputs, outputs, judge_of(kinds_made(module, member), type(module), member))

    def _slot(self, key: str) -> _Slot:
        return self._slots.setdefault(key, _Slot())

    @property
    def due_s(self) -> float:
        """Time of the next round of the frequency; infinite without one."""
        return self._schedule.due_s

    def put(self, key: str, value: object, overwritten: int = 0) -> bool:
        """Store a value from outside the unit; return whether a round is due because of it.

        Args:
            overwritten: Number of values of the key that were dropped since the last ``put``.
        """
        if key not in self._into:
            return False
        slot = self._slots[key]
        overwritten += any(one.seen < slot.number for one in self._fresh[key])
        if overwritten and self._fresh[key]:
            self._overwritten[key] = self._overwritten.get(key, 0) + overwritten
        slot.put(value)
        return self._schedule.arrived(key)

    def waits(self, module: str) -> AwaitedKeys | None:
        """Return what the module waits for; None: the unit has no such module."""
        for seat in self._seats:
            if seat.name == module:
                lacks = seat.lacks()
                needs_all = any(one.port.is_required for one in lacks)
                return AwaitedKeys(seat.times.runs, {one.key: one.slot.number > 0 for one in lacks}, needs_all)
        return None

    def tick(self, now_s: float) -> bool:
        """Return whether a round is due because of the time."""
        return self._schedule.tick(now_s)

    def run(self, now_s: float) -> list[Produced]:
        """Run a round; return the produced values in the order of production."""
        self._schedule.began(now_s)
        produced: list[Produced] = []
        self._settle(now_s)
        for seat in self._seats:
            for key, value in (self._turned(seat, now_s) or {}).items():
                self._slots[key].put(value)
                produced.append(Produced(key, value))
        self._settle(now_s)
        return produced

    def _turned(self, seat: _Seat, now_s: float) -> Mapping[str, object] | None:
        """Return the outputs of this seat in this round; None: inputs are missing."""
        pair = self._exchanging
        if pair is None or pair.old is not seat:
            return self._turn(seat, now_s)
        return pair.exchange.round(now_s, partial(self._turn, seat, now_s), partial(self._turn, pair.new, now_s))

    def _turn(self, seat: _Seat, now_s: float) -> Mapping[str, object] | None:
        given = seat.taken()
        if given is None:
            return None
        began_s, self.computing = self._stopwatch(), Computing(seat.name, now_s)
        try:
            outputs = seat.module.update(seat.module.Inputs(**given))
        except UNPROVED as error:
            if isinstance(error, StopIteration):  # no future can hold it, and a unit with a thread would be still
                raise _as_bug(seat.name, error) from error
            raise
        except BaseException as error:  # CancelledError: a task ends by it without a bug, and the unit would be still
            raise _as_bug(seat.name, error) from error
        finally:
            self.computing = None
        seat.times = seat.times.with_run(self._stopwatch() - began_s)
        return seat.values(outputs)

    def exchange(self, wanted: WantedExchange) -> None:
        """Begin the exchange with the next round; until it is over, it decides which module produces."""
        self._wanted = wanted

    def _settle(self, now_s: float) -> None:
        """Remove a finished exchange, and begin a requested one."""
        if self._exchanging is not None and self._exchanging.exchange.is_over:
            self._end_exchange(self._exchanging)
        if self._wanted is not None and self._exchanging is None:
            wanted, self._wanted = self._wanted, None
            self._begin_exchange(wanted, now_s)

    def _begin_exchange(self, wanted: WantedExchange, now_s: float) -> None:
        [member] = [one for one in wanted.graph.units[self.name] if one.name == wanted.name]
        [old] = [seat for seat in self._seats if seat.name == wanted.name]
        new, seen = self._seat(member, wanted.module), {id(one.slot): one.seen for one in old.inputs}
        new.judge = wanted.judge
        for one in new.inputs:
            one.seen = seen.get(id(one.slot), one.seen)
        self._exchanging = _Exchanging(wanted.exchange, old, new, self._seats)
        order = wanted.graph.order[self.name]  # legal for the old one, too, because the new one has at least its inputs
        self._seats = sorted(self._seats, key=lambda seat: order.index(seat.name))
        wanted.exchange.receive(now_s, lambda: handed_over(old.module, new.module))

    def _end_exchange(self, pair: _Exchanging) -> None:
        self._exchanging = None
        if pair.exchange.phase is ExchangePhase.RETURNED:
            self._seats = pair.seats
            return
        pair.new.times = pair.old.times
        self._seats = [pair.new if seat is pair.old else seat for seat in self._seats]
        self._fresh = self._fresh_inputs()

    def statistics(self, now_s: float = 0.0) -> UnitStatistics:
        """Return the unit's statistics.

        Args:
            now_s: The recent rate falls if no round begins up to this time.
        """
        schedule = self._schedule
        return UnitStatistics(
            schedule.rounds,
            schedule.rate_hz(now_s),
            schedule.ticks,
            schedule.missed,
            schedule.late_s / schedule.ticks if schedule.ticks else 0.0,
            schedule.most_late_s,
            dict(self._overwritten),
            {seat.name: seat.times for seat in self._seats},
        )


def _as_bug(module: str, error: BaseException) -> RuntimeError:
    """Return an exception that ends a task or a thread as a bug, with the place in the module's code."""
    return RuntimeError(f"update of {module} raised {complaint(error)}")
