"""A unit in a thread of its own, on the machine's time: what it delays, what it hands over, and where it runs."""

from __future__ import annotations

import asyncio
import os
import sys
import threading
import time
from collections.abc import AsyncIterator, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path
from typing import Any

import msgspec
import pytest
from sample_modules import Number

from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus
from backbone.component.launch import Launch
from backbone.component.messages import AskStatistics, ComponentState, LogLevel, Statistics, StoryEvent
from backbone.debug_views import ListViews, Views
from backbone.exchange import SwapModule, Swapped
from backbone.keys import Conversation
from backbone.module_waits import AskModule, ModuleWaits
from backbone.naming import Subsystem
from backbone.waiting import end_tasks
from backbone.wire import OversizedMessage
from mission_control.modules import long_updates, unit_exchanges, unit_thread
from mission_control.modules.arrangement import GivenKey, UnitOrder, arranged
from mission_control.modules.execution_unit import ExecutionUnit, Produced
from mission_control.modules.graph import Graph, Member
from mission_control.modules.module import Module
from mission_control.modules.orders import ModuleOrder, Source, UnitParameters, WrongModule
from mission_control.modules.os_threads import ThreadRefused, place_thread
from mission_control.modules.unit_component import UnitComponent
from mission_control.modules.unit_schedule import Trigger
from mission_control.modules.unit_thread import UnitThread

TESTER = "ui_console/tester"
WITHIN_S = 20.0
NUMBERS = {"number": GivenKey("sample_modules:Number", Source(TESTER, Conversation.EVENTS))}
OPEN, BEGUN = threading.Event(), threading.Event()
TICKS_S: list[float] = []


class Passing(Module):
    """Hands each number on when the gate is open; a negative one is a bug."""

    class Inputs(Module.Inputs):
        number: Number

    class Outputs(Module.Outputs):
        same: Number

    def update(self, inputs: Inputs) -> Outputs:
        assert threading.current_thread() is not threading.main_thread()
        BEGUN.set()
        assert OPEN.wait(WITHIN_S)
        if inputs.number.value < 0:
            raise ArithmeticError("negative")
        self.debug.value("passed", inputs.number.value)
        return self.Outputs(inputs.number)


class Ticking(Module):
    """Notes when each of its rounds is."""

    class Outputs(Module.Outputs):
        end: Number

    def reset(self) -> None:
        TICKS_S.clear()

    def update(self, inputs: Module.Inputs) -> Outputs:
        TICKS_S.append(time.monotonic())
        return self.Outputs(Number(float(len(TICKS_S))))


class Behind(Passing):
    """A second such module, in another unit."""

    class Inputs(Module.Inputs):
        same: Number

    class Outputs(Module.Outputs):
        end: Number

    def update(self, inputs: Inputs) -> Outputs:
        return self.Outputs(inputs.same)


ORDERS = [
    UnitOrder(name="one", modules=[ModuleOrder("passing", f"{__name__}:Passing")], own_thread=True),
    UnitOrder(name="two", modules=[ModuleOrder("behind", f"{__name__}:Behind")], own_thread=True, nice=1),
]


@asynccontextmanager
async def running(local_mission: Any, beside: Any, units: Mapping[str, UnitParameters]) -> AsyncIterator[Bus]:
    """Give a bus beside these units, all in this process."""
    clock = MissionClock.started_now()
    async with AsyncExitStack() as stack:
        network = await stack.enter_async_context(local_mission(clock=clock))
        for name, parameters in units.items():
            given = msgspec.to_builtins(parameters)
            launch = Launch("local", Subsystem.MISSION_CONTROL, name, "unit", "", "local", "", 0.0, 1.0, given)
            await stack.enter_async_context(beside(UnitComponent(launch, network.join(launch.address, clock), clock)))
        bus = network.join(TESTER, clock)
        stack.push_async_callback(bus.close)
        yield bus


@asynccontextmanager
async def units(
    local_mission: Any, beside: Any, orders: Sequence[UnitOrder] = ORDERS, output: str = "end"
) -> AsyncIterator[tuple[Bus, asyncio.Queue[Number]]]:
    """Give a bus and the values of this output, beside the units."""
    OPEN.set()
    heard: asyncio.Queue[Number] = asyncio.Queue()
    async with running(local_mission, beside, arranged(orders, NUMBERS)) as bus:
        bus.subscribe(
            f"mission_control/*/{output}", Conversation.OUTPUTS, Number, lambda one: heard.put_nowait(one.body)
        )
        yield bus, heard


async def test_values_go_from_thread_to_thread_as_the_objects_themselves_and_in_order(
    local_mission: Any, beside: Any
) -> None:
    async with units(local_mission, beside) as (bus, heard), asyncio.timeout(WITHIN_S):
        for value in range(50):
            sent = Number(float(value))
            bus.publish(TESTER, Conversation.EVENTS, sent)
            assert (await heard.get()) is sent
        told = (await bus.ask("mission_control/one", AskStatistics(), Statistics, within_s=WITHIN_S)).values
        assert told["rounds"] == 50


async def test_a_long_round_delays_no_answer_and_only_the_newest_value_waits_for_its_end(
    local_mission: Any, beside: Any
) -> None:
    # Only one unit: a second one behind it might itself hear only the newer of two values.
    async with units(local_mission, beside, ORDERS[:1], "same") as (bus, heard), asyncio.timeout(WITHIN_S):
        OPEN.clear()
        BEGUN.clear()
        bus.publish(TESTER, Conversation.EVENTS, Number(1.0))
        await asyncio.to_thread(BEGUN.wait, WITHIN_S)
        for value in (2.0, 3.0, 4.0):  # the first round still runs, and the unit answers in between
            bus.publish(TESTER, Conversation.EVENTS, Number(value))
            assert (await _statistics(bus))["passing_runs"] == 0
        OPEN.set()
        assert [(await heard.get()).value, (await heard.get()).value] == [1.0, 4.0]
        assert (await _statistics(bus))["overwritten_number"] == 2
        listed = await bus.ask("mission_control/one", ListViews(), Views, within_s=WITHIN_S)
        assert [(one.view, one.value) for one in listed.views] == [("passing-passed", 4.0)]


async def test_an_update_that_does_not_end_is_named_until_it_ends(
    local_mission: Any, beside: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(long_updates, "LONG_UPDATE_S", 0.05)
    told, logged = asyncio.Queue[str](), asyncio.Queue[StoryEvent]()
    async with units(local_mission, beside, ORDERS[:1], "same") as (bus, _heard), asyncio.timeout(WITHIN_S):
        bus.subscribe(
            "mission_control/one", Conversation.STATUS, ComponentState, lambda one: told.put_nowait(one.body.feedback)
        )
        bus.subscribe("mission_control/one", Conversation.LOG, StoryEvent, lambda one: logged.put_nowait(one.body))
        OPEN.clear()
        bus.publish(TESTER, Conversation.EVENTS, Number(1.0))
        while not (text := await told.get()).startswith("passing computes since "):
            pass
        waits = await bus.ask("mission_control/one", AskModule("passing"), ModuleWaits, within_s=WITHIN_S)
        assert text == f"passing computes since {waits.computes_since_s:.3f} s"
        event = await logged.get()
        assert (event.subject, event.level) == ("passing", LogLevel.WARNING)
        assert event.what == f"update does not end; it computes since {waits.computes_since_s:.3f} s"
        await asyncio.sleep(0.2)  # for several looks at the same update
        OPEN.set()
        while (await told.get()) != "":
            pass
        assert (await logged.get()).what == "update ends in time again; it was late 1 time", "named once"


async def _statistics(bus: Bus) -> dict[str, float]:
    return (await bus.ask("mission_control/one", AskStatistics(), Statistics, within_s=WITHIN_S)).values


TICKING = UnitOrder(
    name="one", modules=[ModuleOrder("ticking", f"{__name__}:Ticking")], frequency_hz=100.0, own_thread=True
)
BLOCKED_S = 1.0  # as long as a hub that hangs blocks who sends


async def test_a_unit_keeps_its_rate_while_the_loop_is_blocked_and_its_outputs_come_afterwards_in_order(
    local_mission: Any, beside: Any
) -> None:
    async with units(local_mission, beside, [TICKING]) as (_bus, heard), asyncio.timeout(WITHIN_S):
        assert (await heard.get()).value >= 1
        before = len(TICKS_S)
        time.sleep(BLOCKED_S)  # noqa: ASYNC251  that is what is tried
        during = len(TICKS_S) - before
        assert during > 0.1 * BLOCKED_S * 100.0  # a machine with much other work
        values = [(await heard.get()).value for _ in range(during)]
    assert values == [values[0] + number for number in range(during)]


async def test_what_waits_for_a_blocked_loop_is_bounded_and_what_is_lost_is_counted(
    local_mission: Any, beside: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(unit_thread, "MOST_WAITING", 5)
    async with units(local_mission, beside, [TICKING]) as (bus, heard), asyncio.timeout(WITHIN_S):
        first = (await heard.get()).value
        time.sleep(BLOCKED_S)  # noqa: ASYNC251  that is what is tried
        last = float(len(TICKS_S))
        values = [first]
        while values[-1] < last:
            values.append((await heard.get()).value)
        told = await _statistics(bus)
    assert values == sorted(set(values))
    assert told["thread_lost"] >= last - first + 1 - len(values) > 0


async def test_a_bug_in_the_thread_ends_the_unit(local_mission: Any, beside: Any) -> None:
    gone = asyncio.Event()

    async def until_it_ends() -> None:
        async with units(local_mission, beside) as (bus, _heard), asyncio.timeout(WITHIN_S):
            bus.watch_alive("mission_control/one", lambda _address, alive: None if alive else gone.set())
            bus.publish(TESTER, Conversation.EVENTS, Number(-1.0))
            await gone.wait()

    with pytest.raises(ArithmeticError):
        await until_it_ends()


class Reading(Passing):
    """Looks for what is not there."""

    def update(self, inputs: Passing.Inputs) -> Passing.Outputs:
        return self.Outputs(next(one for one in [Number(1.0)] if one.value == inputs.number.value))


async def test_a_stop_iteration_in_the_thread_ends_the_unit_too(local_mission: Any, beside: Any) -> None:
    gone = asyncio.Event()
    order = UnitOrder(name="one", modules=[ModuleOrder("reading", f"{__name__}:Reading")], own_thread=True)

    async def until_it_ends() -> None:
        async with units(local_mission, beside, [order], "same") as (bus, _heard), asyncio.timeout(WITHIN_S):
            bus.watch_alive("mission_control/one", lambda _address, alive: None if alive else gone.set())
            bus.publish(TESTER, Conversation.EVENTS, Number(2.0))
            await gone.wait()

    with pytest.raises(RuntimeError, match="update of reading raised StopIteration"):
        await until_it_ends()


HELD = threading.Event()
HANGING = f"""
from {__name__} import HELD, WITHIN_S, Passing


class Hanging(Passing):
    def update(self, inputs):
        assert HELD.wait(WITHIN_S)
        return super().update(inputs)
"""


@pytest.fixture
def hanging(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Class path of a module whose update waits until ``HELD`` is set."""
    (tmp_path / "hanging_in_its_thread.py").write_text(HANGING)
    monkeypatch.syspath_prepend(tmp_path)
    HELD.set()
    yield "hanging_in_its_thread:Hanging"
    HELD.set()
    sys.modules.pop("hanging_in_its_thread", None)


async def test_a_long_round_of_an_exchange_is_waited_for_without_a_word(
    local_mission: Any, beside: Any, hanging: str
) -> None:
    heard: asyncio.Queue[str] = asyncio.Queue()
    async with units(local_mission, beside, ORDERS[:1], "same") as (bus, _same), asyncio.timeout(WITHIN_S):
        bus.subscribe("mission_control/one", Conversation.LOG, StoryEvent, lambda one: heard.put_nowait(one.body.what))
        asked = SwapModule("passing", hanging, prove_s=1.0)
        swapping = asyncio.create_task(bus.ask("mission_control/one", asked, Swapped, within_s=WITHIN_S))
        assert "warms" in await heard.get()
        bus.publish(TESTER, Conversation.EVENTS, Number(1.0))
        assert "has to prove itself" in await heard.get()
        HELD.clear()
        bus.publish(TESTER, Conversation.EVENTS, Number(2.0))
        await asyncio.sleep(1.3)  # the time to prove itself is over, and the round goes on
        HELD.set()
        assert (await swapping).is_proved
        assert "goes on" in await heard.get()


async def test_a_new_module_that_hangs_in_its_thread_ends_the_unit_which_starts_again_with_the_old_class(
    local_mission: Any, beside: Any, hanging: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(unit_exchanges, "HANGS_S", 0.1)

    async def until_it_ends() -> None:
        async with units(local_mission, beside, ORDERS[:1], "same") as (bus, _same), asyncio.timeout(WITHIN_S):
            HELD.clear()
            asked = SwapModule("passing", hanging, ready_within_s=1.0)
            swapping = asyncio.create_task(bus.ask("mission_control/one", asked, Swapped, within_s=WITHIN_S))
            warms = asyncio.Event()
            bus.subscribe("mission_control/one", Conversation.LOG, StoryEvent, lambda _one: warms.set())
            await warms.wait()
            bus.publish(TESTER, Conversation.EVENTS, Number(1.0))
            with pytest.raises(WrongModule, match=f"a round with {hanging} has not ended for"):
                await swapping

    with pytest.raises(RuntimeError, match="a round with"):
        await until_it_ends()


async def test_an_output_that_cannot_be_sent_is_a_bug_of_the_unit_and_does_not_hold_up_the_next() -> None:
    clock, bugs = MissionClock.started_now(), asyncio.Queue[BaseException]()
    graph = Graph({"one": [Member("ticking", Ticking.ports())]})
    unit = ExecutionUnit("one", graph, {"ticking": Ticking()}, Trigger(100.0), clock.now_s())

    def send(_now_s: float, _produced: Sequence[Produced]) -> None:
        raise OversizedMessage("too long")

    keeping = asyncio.create_task(UnitThread(unit, clock, send, bugs.put_nowait).keep())
    try:
        async with asyncio.timeout(WITHIN_S):
            await bugs.get()
            time.sleep(0.1)  # noqa: ASYNC251  so that several rounds wait
            assert [type(await bugs.get()) for _ in range(3)] == [OversizedMessage] * 3
    finally:
        await end_tasks(keeping)


async def test_a_unit_runs_where_and_as_urgently_as_it_was_told(local_mission: Any, beside: Any) -> None:
    there = min(os.sched_getaffinity(0))
    [order, _] = ORDERS
    placed = msgspec.structs.replace(order, name="one", nice=2, cpus=[there])
    async with units(local_mission, beside, [placed]) as (bus, _heard):
        told = await _statistics(bus)
    assert told["thread_nice"] == min(19, os.getpriority(os.PRIO_PROCESS, 0) + 2)
    assert told["thread_processors"] == 1
    assert os.sched_getaffinity(0) >= {there}


async def test_a_unit_that_cannot_have_its_processor_says_so_at_its_start(local_mission: Any, beside: Any) -> None:
    [order, _] = ORDERS
    with pytest.raises(ThreadRefused, match="processor 4095"):
        async with units(local_mission, beside, [msgspec.structs.replace(order, cpus=[4095])]):
            pass


def test_only_its_thread_is_placed_and_a_priority_that_the_user_may_not_have_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def forbidden(_which: int, _who: int, _nice: int) -> None:
        raise PermissionError

    before = os.getpriority(os.PRIO_PROCESS, threading.get_native_id())
    with ThreadPoolExecutor(1) as pool:
        placed = pool.submit(place_thread, 1, ()).result()
        assert placed.id != threading.get_native_id()
        assert placed.nice == min(19, before + 1)
        monkeypatch.setattr(os, "setpriority", forbidden)
        with pytest.raises(ThreadRefused, match="niceness") as refused:
            pool.submit(place_thread, -5, ()).result()
    assert "CAP_SYS_NICE" in refused.value.remedy
    assert os.getpriority(os.PRIO_PROCESS, threading.get_native_id()) == before


def test_niceness_needs_a_thread() -> None:
    with pytest.raises(msgspec.ValidationError, match="a thread of its own"):
        msgspec.convert({"name": "one", "nice": 1, "modules": []}, UnitOrder)
