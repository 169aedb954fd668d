"""Behaviors are exchanged while they run: one acts at any instant, no grant is lost, the old one comes back."""

from __future__ import annotations

import asyncio
import itertools
import sys
from collections.abc import Awaitable, Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from behaviors_of_a_placer import ARC, MADE, node, root
from fake_resource_pool import FakeArc, FakePlacer, Run
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from backbone.bus.interface import Bus
from backbone.component.messages import AskParameters, AskState, ComponentState, Parameters, WrongParameter
from backbone.errors import Refusal
from backbone.exchange import ExchangeRunning, NotExchanged, SwapClass, Swapped
from backbone.placer.messages import ReviseStart
from backbone.reading_anew import WrongClass
from mission_control.behavior import Behavior
from mission_control.messages import BehaviorStatus
from resource_pool.commands import Drive

AT = "mission_control/turner"
SOURCE = """
from behaviors_of_a_placer import MADE
from mission_control.behavior import Behavior, BehaviorParameters


class TurnerParameters(BehaviorParameters, frozen=True, kw_only=True):
    speed_rad_s: float = 1.0


class Turner(Behavior[TurnerParameters]):
    parameters_type = TurnerParameters
    hands_over = frozenset({"turns"})

    def __init__(self, launch, bus, clock):
        super().__init__(launch, bus, clock)
        self.turns = 0
        MADE.append(self)

    async def act(self):
        while True:
            self.turns += 1
            await self.arc.drive(self.parameters.speed_rad_s, float(self.turns))
            await self.clock.sleep_s(0.1)
"""
MESSAGE = "class TurnerMessage(__import__('backbone.wire').wire.Message, frozen=True):\n    pass\n"
ACT = "    async def act"
BROKEN = {
    "in its text": ("class Turner(", "class Turner((", "SyntaxError"),
    "when it is made": ("self.turns = 0", "self.turns = 1 / 0", "ZeroDivisionError"),
    "in a field": ("    hands", "    class parameters_type(TurnerParameters):\n        p: 'it' = 1\n    hands", "'it'"),
    "when it starts": (ACT, f"    async def start(self):\n        raise OSError('dark')\n\n{ACT}", "dark"),
    "when it says whether it is ready": (ACT, f"    def is_ready(self):\n        raise OSError('dim')\n\n{ACT}", "dim"),
    "when it is neither": (
        ACT,
        f"    def is_ready(self):\n        return __import__('numpy').zeros(2)\n\n{ACT}",
        "truth",
    ),
    "when it acts": ("self.turns += 1", "raise ValueError('planted')", "planted"),
    "by an exit": ("self.turns += 1", "raise SystemExit(3)", "SystemExit"),
    "by an exit at a grant": (ACT, f"    async def resumed(self, _):\n        raise SystemExit\n\n{ACT}", "SystemExit"),
    "by an interruption": ("self.turns += 1", "raise KeyboardInterrupt", "KeyboardInterrupt"),
    "by its own report": (
        "self.turns += 1",
        "self.finish('failure' and __import__('mission_control.messages').messages.BehaviorStatus.FAILURE)",
        "failure",
    ),
    "never ready": (ACT, f"    def is_ready(self):\n        return False\n\n{ACT}", "not ready"),
}


class Stage:
    """A behavior that turns, its ARC, a file that can be edited, and an operator."""

    def __init__(self, folder: Path, name: str) -> None:
        self.file, self.name = folder / f"{name}.py", name
        self.placer: FakePlacer
        self.arc: FakeArc
        self.bus: Bus

    @property
    def path(self) -> str:
        return f"{self.name}:Turner"

    def edit(self, old: str = "", new: str = "") -> None:
        self.file.write_text(SOURCE.replace(old, new) if old else SOURCE)

    async def swap(self, prove_s: float = 1.0, ready_s: float = 2.0, path: str = "", **parameters: Any) -> Swapped:
        asked = SwapClass(path or self.path, parameters, prove_s, ready_s, user="anna")
        return await self.bus.ask(AT, asked, Swapped, within_s=60.0)

    async def feedback(self) -> str:
        return (await self.bus.ask(AT, AskState(), ComponentState, within_s=1.0)).feedback

    def drives(self) -> list[tuple[float, Drive]]:
        return [(at_s, command) for at_s, _epoch, command in self.arc.commands if isinstance(command, Drive)]

    def turned(self) -> list[float]:
        return [command.right_rad_s for _at_s, command in self.drives()]

    def speeds(self) -> list[float]:
        return [speed for speed, _ in itertools.groupby(command.left_rad_s for _at_s, command in self.drives())]

    async def sleep(self, duration_s: float) -> None:
        await self.placer.clock.sleep_s(duration_s)

    async def begin(self, placer: FakePlacer, **rest: Any) -> Any:
        self.placer = placer
        module = __import__(self.name)
        placer.classes = {**placer.classes, "turner": module.Turner}
        turner = await root(placer, node("turner", "turner", arc=ARC, **rest))
        await placer.wait(lambda: placer.arcs)
        self.arc = placer.arcs["turner-capture"]
        self.bus = placer.network.join("ui_console/tester", placer.clock)
        return turner


@pytest.fixture
def stage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> Iterator[Stage]:
    monkeypatch.syspath_prepend(tmp_path)
    made = Stage(tmp_path, f"turning_{abs(hash(request.node.nodeid))}")
    made.edit()
    yield made
    sys.modules.pop(made.name, None)


@pytest.fixture
def play(stage: Stage, placer_world: Run) -> Callable[[Callable[[], Awaitable[None]]], None]:
    def run(scene: Callable[[], Awaitable[None]]) -> None:
        async def begin(placer: FakePlacer) -> None:
            await stage.begin(placer)
            try:
                await scene()
            finally:
                await stage.bus.close()

        placer_world(begin)

    return run


Play = Callable[[Callable[[], Awaitable[None]]], None]


def test_an_edited_class_goes_on_with_the_state_under_the_same_grant(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        await stage.arc.grant()
        await stage.sleep(0.5)
        swapped = await stage.swap(speed_rad_s=2.0)
        assert (swapped.is_proved, swapped.cause, swapped.keeps_state) == (True, "", True)
        assert swapped.rounds == pytest.approx(10, abs=2)
        await stage.sleep(0.5)
        assert stage.speeds() == [1.0, 2.0]
        assert stage.turned() == [float(number + 1) for number in range(len(stage.turned()))]
        assert stage.placer.started.count("turner-capture") == 1
        assert (stage.arc.epoch, stage.arc.released) == (1, "")
        told = await stage.bus.ask(AT, AskParameters(), Parameters, within_s=1.0)
        assert told.values["speed_rad_s"] == 2.0
        assert "goes on with the state of" in await stage.feedback()
        await stage.arc.suspend()
        count = len(stage.drives())
        await stage.sleep(0.5)
        assert len(stage.drives()) == count
        await stage.arc.grant()
        await stage.sleep(0.5)
        assert stage.turned()[-1] == len(stage.turned()) > count

    play(scene)


def test_other_state_is_not_handed_over(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        await stage.arc.grant()
        await stage.sleep(0.5)
        stage.edit('frozenset({"turns"})', 'frozenset({"turns", "name"})')
        swapped = await stage.swap()
        assert (swapped.is_proved, swapped.keeps_state) == (True, False)
        assert stage.turned()[-1] < len(stage.turned())

    play(scene)


def test_one_that_waits_for_its_grant_is_exchanged_without_a_new_request(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        swapped = await stage.swap(speed_rad_s=2.0)
        assert swapped.is_proved
        assert not stage.drives()
        await stage.arc.grant()
        await stage.sleep(0.5)
        assert stage.speeds() == [2.0]
        assert stage.placer.started.count("turner-capture") == 1

    play(scene)


@pytest.mark.parametrize("broken", BROKEN)
def test_the_old_one_goes_on_when_the_new_one_fails(stage: Stage, play: Play, broken: str) -> None:
    async def scene() -> None:
        await stage.arc.grant()
        await stage.sleep(0.5)
        old, new, cause = BROKEN[broken]
        stage.edit(old, new)
        try:
            swapped = await stage.swap(speed_rad_s=2.0)
            assert not swapped.is_proved
            told = swapped.cause
        except Refusal as refusal:
            told = refusal.detail
        assert cause in told
        count = len(stage.drives())
        await stage.sleep(1.0)
        assert len(stage.drives()) >= count + 8
        assert stage.speeds()[-1] == 1.0
        assert stage.turned() == [float(number + 1) for number in range(len(stage.turned()))]
        assert (stage.arc.epoch, stage.arc.released) == (1, "")
        stage.edit()
        assert (await stage.swap(speed_rad_s=3.0)).is_proved, "another exchange is possible"

    play(scene)


def test_a_hundred_exchanges_lose_neither_the_grant_nor_a_turn(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        await stage.arc.grant()
        for number in range(100):
            swapped = await stage.swap(prove_s=0.3, speed_rad_s=float(number + 2))
            assert (swapped.is_proved, swapped.keeps_state) == (True, True), swapped.cause
        await stage.sleep(0.3)
        assert stage.turned() == [float(number + 1) for number in range(len(stage.turned()))]
        assert stage.speeds() == [1.0, *map(float, range(2, 102))]
        assert (stage.arc.epoch, stage.arc.released) == (1, "")
        assert len(stage.placer.network.listeners) < 50

    play(scene)


def test_refusals_change_nothing(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        await stage.arc.grant()
        with pytest.raises(WrongParameter, match="refuses its parameters"):
            await stage.swap(speed="fast")
        with pytest.raises(WrongClass, match="is no behavior"):
            await stage.swap(path="resource_pool.rcs.skeleton:Lamp")
        with pytest.raises(Refusal, match="no_such_file"):
            await stage.swap(path="no_such_file:Turner")
        stage.edit("    parameters_type", "    accepts = Behavior.accepts | TurnerMessage\n    parameters_type")
        stage.file.write_text(stage.file.read_text().replace("class Turner(", MESSAGE + "\n\nclass Turner("))
        with pytest.raises(WrongClass, match="other questions"):
            await stage.swap()
        stage.edit()
        first = asyncio.create_task(stage.swap(prove_s=3.0))
        await stage.sleep(0.2)
        with pytest.raises(ExchangeRunning):
            await stage.swap()
        assert (await first).is_proved
        assert stage.turned() == [float(number + 1) for number in range(len(stage.turned()))]

    play(scene)


def test_one_with_children_is_not_exchanged(stage: Stage, placer_world: Run) -> None:
    async def scene(placer: FakePlacer) -> None:
        await stage.begin(placer, children=[node("below", "watcher")])
        with pytest.raises(NotExchanged, match="has children"):
            await stage.swap()
        await stage.bus.close()

    placer_world(scene)


def test_its_end_during_an_exchange_is_its_end(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        await stage.arc.grant()
        swapping = asyncio.create_task(stage.swap(prove_s=5.0, speed_rad_s=2.0))
        await stage.sleep(1.0)
        assert stage.speeds()[-1] == 2.0
        stage.placer.components["turner"].end("the test ends it")
        await stage.placer.wait(lambda: "turner" not in stage.placer.components)
        with pytest.raises(Exception, match="turner"):
            await swapping
        assert stage.arc.released

    play(scene)


def test_one_that_finishes_while_the_new_one_warms_has_finished(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        await stage.arc.grant()
        stage.edit(ACT, f"    def is_ready(self):\n        return self.clock.now_s() > 3.0\n\n{ACT}")
        swapping = asyncio.create_task(stage.swap(ready_s=30.0, speed_rad_s=2.0))
        await stage.sleep(1.0)
        turner = stage.placer.components["turner"]
        assert isinstance(turner, Behavior)
        turner.finish(BehaviorStatus.SUCCESS)
        swapped = await swapping
        assert (swapped.is_proved, swapped.cause) == (False, "the old one finished before it was ready")
        await stage.sleep(4.0)
        assert (set(stage.speeds()), bool(stage.arc.released)) == ({1.0}, True)
        assert turner.status is BehaviorStatus.SUCCESS

    play(scene)


@pytest.mark.parametrize("fails", [False, True])
def test_an_arc_that_dies_meanwhile_is_claimed_again_by_the_one_in_charge(
    stage: Stage, play: Play, fails: bool
) -> None:
    async def scene() -> None:
        await stage.arc.grant()
        if fails:
            stage.edit(
                "self.turns += 1", "self.turns += 1\n            if self.turns > 20: raise ValueError('planted')"
            )
        swapping = asyncio.create_task(stage.swap(prove_s=6.0, speed_rad_s=2.0))
        await stage.sleep(0.5)
        await stage.placer.kill("turner-capture")
        await stage.placer.wait(lambda: "turner-capture" in stage.placer.arcs)
        stage.arc = stage.placer.arcs["turner-capture"]
        await stage.arc.grant()
        assert (await swapping).is_proved is not fails
        await stage.sleep(0.5)
        assert stage.speeds() == ([2.0, 1.0] if fails else [2.0])
        await stage.sleep(5.0)
        assert stage.placer.arcs["turner-capture"] is stage.arc
        assert stage.placer.started.count("turner-capture") == 2

    play(scene)


def swaps_going(swaps: Sequence[asyncio.Task[Any]]) -> bool:
    return any(not swap.done() for swap in swaps)


EVENTS = st.lists(
    st.tuples(st.sampled_from(["grant", "suspend", "swap", "broken", "end"]), st.integers(0, 12)), max_size=12
)
FAILS = "if self.turns % 3 == 0: raise ValueError('planted')\n            self.turns += 1"


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])  # each example begins with a new file
@given(EVENTS)
def test_at_any_instant_at_most_one_acts_and_under_the_one_grant(
    stage: Stage, placer_world: Run, events: Sequence[tuple[str, int]]
) -> None:
    def one_is_in_charge(_command: Any = None) -> None:
        assert sum(one.gate.is_open for one in MADE) <= 1

    async def scene(placer: FakePlacer) -> None:
        await stage.begin(placer)
        stage.arc.require = one_is_in_charge
        swaps: list[asyncio.Task[Any]] = []
        for number, (event, pause) in enumerate(events):
            match event:
                case "grant" if not stage.arc.granted:
                    await stage.arc.grant()
                case "suspend" if stage.arc.granted and not swaps_going(swaps):  # one that waits could not fail
                    await stage.arc.suspend()
                case "swap" | "broken" if event == "swap" or stage.arc.granted:
                    stage.edit(*(("self.turns += 1", FAILS) if event == "broken" else ("", "")))
                    swaps.append(asyncio.create_task(stage.swap(prove_s=0.4, speed_rad_s=float(number + 2))))
            await stage.sleep(pause / 20)
            one_is_in_charge()
        await asyncio.gather(*swaps, return_exceptions=True)
        one_is_in_charge()
        if not stage.arc.granted:
            await stage.arc.grant()
        count = len(stage.drives())
        await stage.sleep(0.5)
        assert len(stage.drives()) >= count + 4, "one of them acts"
        last, before = dict[float, float](), 0.0
        for _at_s, drive in stage.drives():
            assert drive.right_rad_s in (before + 1, last.get(drive.left_rad_s, 0.0) + 1), "it goes on with its state"
            before = last[drive.left_rad_s] = drive.right_rad_s
        assert stage.arc.released == ""
        assert placer.started.count("turner-capture") == 1
        await stage.bus.close()

    MADE.clear()
    sys.modules.pop(stage.name, None)
    stage.edit()
    placer_world(scene)


def test_a_restart_after_an_exchange_has_the_new_class(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        await stage.swap(prove_s=0.0)
        revised = [one for one in stage.placer.revised if isinstance(one, ReviseStart)]
        assert [(one.name, one.class_path) for one in revised] == [("turner", stage.path)]

    play(scene)
