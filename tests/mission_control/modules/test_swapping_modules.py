"""An operator exchanges modules of a unit that runs on the bus: files are read anew, refusals change nothing."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Awaitable, Callable, Iterator
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any

import msgspec
import pytest

from backbone.addresses import PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus
from backbone.bus.local_bus import LocalNetwork
from backbone.component.launch import Launch
from backbone.component.messages import (
    AskParameters,
    AskState,
    AskStory,
    ComponentState,
    LogLevel,
    Parameters,
    SetParameter,
    Story,
    WrongParameter,
)
from backbone.debug_views import ListViews, ViewKind, Views
from backbone.exchange import ExchangeRunning, SwapModule, Swapped, UnknownModule
from backbone.keys import Conversation
from backbone.naming import Subsystem
from backbone.placer.messages import ReviseStart, StartRevised
from backbone.reading_anew import ValuesChanged
from backbone.wire import Envelope, Message
from mission_control.modules.arrangement import UnitOrder, arranged
from mission_control.modules.graph import GraphRefused
from mission_control.modules.orders import ModuleOrder, UnitParameters, WrongModule
from mission_control.modules.ports import WrongDeclaration
from mission_control.modules.unit_component import UnitComponent

UNIT = "mission_control/one"
WITHIN_S = 60.0
SOURCE = """
from typing import Annotated
from backbone.wire import Message
from mission_control.modules.module import Module
from mission_control.modules.ports import LATEST


class Level(Message, frozen=True):
    height_m: float


class Count(Message, frozen=True):
    number: int
    who: str


class Counter(Module):
    class Inputs(Module.Inputs):
        level: Annotated[Level | None, LATEST] = None

    class Outputs(Module.Outputs):
        count: Count

    class Parameters(Module.Parameters, frozen=True):
        who: str = "first"
        step: int = 1

    class State(Module.State):
        number: int = 0

    parameters: Parameters
    state: State

    def update(self, inputs):
        self.state.number += self.parameters.step
        return self.Outputs(Count(self.state.number, self.parameters.who))


class Levels(Module):
    class Outputs(Module.Outputs):
        level: Level

    def update(self, inputs):
        return self.Outputs(Level(1.0))
"""


class Stage:
    """A unit with a counter at 30 Hz, a file that can be edited, and an operator."""

    def __init__(self, folder: Path, name: str) -> None:
        self.file, self.name = folder / f"{name}.py", name
        self.bus: Bus
        self.counts: list[Any] = []
        self.revised: list[ReviseStart] = []

    @property
    def path(self) -> str:
        return f"{self.name}:Counter"

    def edit(self, old: str = "", new: str = "") -> None:
        self.file.write_text(SOURCE.replace(old, new) if old else SOURCE)

    def parameters(self) -> UnitParameters:
        modules = [ModuleOrder("counter", self.path), ModuleOrder("levels", f"{self.name}:Levels")]
        return arranged([UnitOrder(name="one", frequency_hz=30.0, modules=modules)], {})["one"]

    async def swap(self, class_path: str = "", prove_s: float = 1.0, **parameters: Any) -> Swapped:
        asked = SwapModule("counter", class_path or self.path, parameters, prove_s, user="anna")
        return await self.bus.ask(UNIT, asked, Swapped, within_s=WITHIN_S)

    async def feedback(self) -> str:
        return (await self.bus.ask(UNIT, AskState(), ComponentState, within_s=1.0)).feedback

    async def story(self) -> list[tuple[LogLevel, str]]:
        told = await self.bus.ask(UNIT, AskStory("counter"), Story, within_s=1.0)
        return [(one.level, one.what) for one in told.events]

    def count_on(self) -> None:
        """Return if no count is lost and none is doubled."""
        numbers = [one.number for one in self.counts]
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))

    async def play(self, local_mission: Any, beside: Any, scene: Callable[[], Awaitable[None]]) -> None:
        async with AsyncExitStack() as stack:
            network: LocalNetwork = await stack.enter_async_context(local_mission())
            placer = network.join(PLACER, VirtualClock())
            stack.push_async_callback(placer.close)

            async def revise(asked: Envelope[Message]) -> Message:
                assert isinstance(asked.body, ReviseStart)
                self.revised.append(asked.body)
                return StartRevised()

            placer.serve(PLACER, ReviseStart, revise)
            given, kind = msgspec.to_builtins(self.parameters()), "mission_control.modules.unit_component:UnitComponent"
            launch = Launch(
                "local", Subsystem.MISSION_CONTROL, "one", "execution_unit", kind, "local", "", 0.0, 1.0, given
            )
            unit = UnitComponent(launch, network.join(launch.address, VirtualClock()), VirtualClock())
            await stack.enter_async_context(beside(unit))
            self.bus = network.join("ui_console/tester", VirtualClock())
            stack.push_async_callback(self.bus.close)
            counted = sys.modules[self.name].Count
            self.bus.subscribe(
                f"{UNIT}/count", Conversation.OUTPUTS, counted, lambda envelope: self.counts.append(envelope.body)
            )
            await VirtualClock().sleep_s(0.5)
            await scene()


@pytest.fixture
def stage(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> Iterator[Stage]:
    monkeypatch.syspath_prepend(tmp_path)
    made = Stage(tmp_path, f"swapped_{abs(hash(request.node.name))}")
    made.edit()
    yield made
    sys.modules.pop(made.name, None)


Play = Callable[[Callable[[], Awaitable[None]]], None]


@pytest.fixture
def play(stage: Stage, local_mission: Any, beside: Any) -> Play:
    return lambda scene: run_virtual(stage.play(local_mission, beside, scene))


@pytest.mark.parametrize("prove_s", [0.0, 1.0])
def test_a_new_class_may_show_otherwise_what_the_old_one_showed(stage: Stage, play: Play, prove_s: float) -> None:
    async def scene() -> None:
        count = "self.state.number += self.parameters.step"
        views = []
        for shows in ("value('count', 1); self.debug.value('other', 2)", "picture('count', lambda: None)"):
            stage.edit(count, f"{count}; self.debug.{shows}")
            assert (await stage.swap(prove_s=prove_s)).cause == ""
            await VirtualClock().sleep_s(0.5)
            listed = await stage.bus.ask(UNIT, ListViews(), Views, within_s=1.0)
            views.append([(one.view, one.kind, one.value) for one in listed.views])
        assert views == [
            [("counter-count", ViewKind.VALUE, 1.0), ("counter-other", ViewKind.VALUE, 2.0)],
            [("counter-count", ViewKind.PICTURE, "")],
        ]

    play(scene)


def test_an_edited_file_is_the_new_code_and_goes_on_with_the_state(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        stage.edit("self.parameters.who", "'second'")
        before = sys.modules[stage.name]
        swapped = await stage.swap()
        assert (swapped.is_proved, swapped.cause, swapped.keeps_state) == (True, "", True)
        assert swapped.proving_s == pytest.approx(1.0, abs=0.1)
        await VirtualClock().sleep_s(0.5)
        stage.count_on()
        assert [stage.counts[0].who, stage.counts[-1].who] == ["first", "second"]
        assert type(stage.counts[-1]) is before.Count, "classes of values stay, because others have them"
        assert await stage.feedback() == f"counter: {stage.path} goes on with the state of {stage.path}"
        told = await stage.story()
        assert told[0] == (LogLevel.NOTICE, f"{stage.path} warms beside {stage.path} for anna")

    play(scene)


def test_the_same_path_swapped_again_is_what_stands_in_the_file_then(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        for who in ("second", "thirdd"):  # the same length, within the same second
            stage.edit("self.parameters.who", f"'{who}'")
            await stage.swap(prove_s=0.0)
        await VirtualClock().sleep_s(0.2)
        assert stage.counts[-1].who == "thirdd"

    play(scene)


def test_a_hundred_swaps_at_thirty_hertz_lose_nothing_and_double_nothing(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        for number in range(100):
            assert (await stage.swap(prove_s=0.05, who=str(number))).is_proved
        stage.count_on()
        assert stage.counts[-1].who == "99"

    play(scene)


@pytest.mark.parametrize(
    ("old", "new", "cause"),
    [
        ("class Counter(Module):", "class Counter(Module:", "SyntaxError"),
        ("class Counter(Module):", "class Another(Module):", "has no attribute 'Counter'"),
        ("class Counter(Module):", "import nowhere\nclass Counter(Module):", "No module named 'nowhere'"),
        ("class Counter(Module):", "import sys\nsys.exit(3)\nclass Counter(Module):", "SystemExit: 3"),
        ("    def update", "    def reset(self):\n        raise OSError('no camera')\n\n    def update", "no camera"),
        ("class Counter(Module):", "class Counter:\n    pass\nclass Old(Module):", "is no module"),
        ("        step: int = 1", "        step: 'nit' = 1", "name 'nit' is not defined"),
        ("class Parameters(Module.Parameters, frozen=True):", "class Parameters:", "with a struct type"),
        ("        count: Count", "        count: 'Count.Nope'", "has no attribute 'Nope'"),
        ("        count: Count", "        count: 'Annotated[Count]'", "Annotated"),
        ("class Outputs(Module.Outputs):\n        count", "class Outputs:\n        count", "Outputs"),
    ],
)
def test_a_class_that_cannot_be_made_is_refused_and_nothing_changes(
    stage: Stage, play: Play, old: str, new: str, cause: str
) -> None:
    async def scene() -> None:
        before = sys.modules[stage.name]
        stage.edit(old, new)
        with pytest.raises((WrongModule, WrongDeclaration), match=cause):
            await stage.swap()
        assert sys.modules[stage.name] is before
        await VirtualClock().sleep_s(0.5)
        stage.count_on()
        assert {one.who for one in stage.counts} == {"first"}
        assert cause in await stage.feedback()
        level, what = (await stage.story())[-1]
        assert level is LogLevel.WARNING
        assert "is not exchanged" in what
        assert stage.revised == []

    play(scene)


@pytest.mark.parametrize(
    ("new", "cause"),
    [
        ("1 / 0", "ZeroDivisionError"),
        ("return None", "not its Outputs"),
        ("return self.Outputs(Level(1.0))", "Level as count, not"),
        ("import sys; sys.exit(3)", "SystemExit: 3"),
        ("raise KeyboardInterrupt", "KeyboardInterrupt"),
        (r"raise ValueError('no model caf\udce9')", r"no model caf\udce9"),
        ("return self.Outputs(None)", "returned None as count"),
        ("return self.Outputs(Count('one', 'second'))", "count, which cannot be sent: Count/1: Expected `int`"),
        ("return self.Outputs(Count(1, {1}.pop))", "count, which cannot be sent: Encoding objects"),
        (r"return self.Outputs(Count(1, '\udce9'))", "count, which cannot be sent: Count has a text that is not UTF-8"),
        ("return self.Outputs(Count(1, ' ' * 2**26))", "count, which cannot be sent: Count of 67108"),
        ("return self.Outputs(type('Sub', (Count,), {}, frozen=True)(1, ''))", ":Sub as count, not"),
    ],
)
def test_a_new_one_that_fails_gives_way_to_the_old_one_and_the_cause_is_named(
    stage: Stage, play: Play, new: str, cause: str
) -> None:
    async def scene() -> None:
        before = sys.modules[stage.name]
        stage.edit("self.state.number += self.parameters.step", f"self.state.number += 1\n        {new}")
        swapped = await stage.swap()
        assert not swapped.is_proved
        assert cause in swapped.cause
        assert sys.modules[stage.name] is before
        await VirtualClock().sleep_s(0.5)
        stage.count_on()
        assert {one.who for one in stage.counts} == {"first"}
        assert cause in await stage.feedback()
        msgspec.msgpack.encode([swapped, await stage.feedback()])
        level, what = (await stage.story())[-1]
        assert (level, cause in what) == (LogLevel.WARNING, True)
        assert "uses the present file" in swapped.remark
        assert stage.revised == []

    play(scene)


def test_one_that_fails_while_it_proves_itself_loses_no_count(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        stage.edit(
            "self.state.number += self.parameters.step",
            "self.tries = getattr(self, 'tries', 0) + 1\n        if self.tries > 9: raise ValueError('late')\n"
            "        self.state.number += 1",
        )
        swapped = await stage.swap(who="second")
        assert (swapped.is_proved, swapped.rounds) == (False, 8)
        await VirtualClock().sleep_s(0.5)
        stage.count_on()
        assert [one.who for one in stage.counts].count("second") == 8
        assert any("is back" in what for _level, what in await stage.story())

    play(scene)


def test_other_ports_are_refused_with_all_faults_at_once(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        stage.edit(
            "        level: Annotated[Level | None, LATEST] = None\n\n"
            "    class Outputs(Module.Outputs):\n        count: Count",
            "        count: Count\n        other: Annotated[Level | None, LATEST] = None\n\n"
            "    class Outputs(Module.Outputs):\n        counts: Level",
        )
        with pytest.raises(GraphRefused) as refused:
            await stage.swap()
        for part in ("no output count", "an output counts", "no input level", "needs count", "takes other"):
            assert part in refused.value.detail

    play(scene)


def test_a_further_optional_input_is_fed(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        wider = (
            "Annotated[Level | None, LATEST] = None\n        mine: Annotated[Count | None, LATEST, Key('count')] = None"
        )
        stage.edit("Annotated[Level | None, LATEST] = None", wider)
        stage.file.write_text(
            stage.file.read_text()
            .replace("import LATEST", "import LATEST, Key")
            .replace("self.parameters.who))", "'after ' + str(inputs.mine.number if inputs.mine else 0)))")
        )
        assert (await stage.swap(prove_s=0.2)).is_proved
        await VirtualClock().sleep_s(0.2)
        assert stage.counts[-1].who == f"after {stage.counts[-2].number}"
        stage.count_on()

    play(scene)


def test_classes_of_values_must_stay_as_they_are(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        stage.edit("    number: int\n    who", "    number: float\n    who")
        with pytest.raises(ValuesChanged, match="declares Count differently"):
            await stage.swap()

    play(scene)


def test_parameters_are_kept_unless_they_are_set_and_the_next_life_has_the_new_class(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        await stage.swap(prove_s=0.1, who="second")
        await stage.swap(prove_s=0.1, step=2)
        await VirtualClock().sleep_s(0.2)
        first, second = stage.counts[-2:]
        assert (second.who, second.number - first.number) == ("second", 2)
        values = (await stage.bus.ask(UNIT, AskParameters(), Parameters, within_s=1.0)).values
        assert values["modules"][0]["parameters"] == {"who": "second", "step": 2}
        assert [one.parameters["modules"][0]["parameters"] for one in stage.revised][-1] == {"who": "second", "step": 2}
        assert stage.revised[-1].parameters == values
        with pytest.raises(WrongModule, match="refuses its parameters"):
            await stage.swap(pace=3)

    play(scene)


def test_one_exchange_at_a_time_and_only_of_modules_that_there_are(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        running = asyncio.create_task(stage.swap())
        await VirtualClock().sleep_s(0.1)
        with pytest.raises(ExchangeRunning, match="exchanging counter"):
            await stage.swap()
        assert (await running).is_proved
        with pytest.raises(WrongParameter):
            await stage.bus.ask(UNIT, SetParameter("frequency_hz", 3.0), Message, within_s=1.0)
        await stage.bus.ask(UNIT, SetParameter("chosen", {}), Parameters, within_s=1.0)
        with pytest.raises(UnknownModule, match="did you mean"):
            await stage.bus.ask(UNIT, SwapModule("countre", stage.path), Swapped, within_s=1.0)

    play(scene)
