"""Modules of a real mission are exchanged while it runs: by command, a hundred times at 30 Hz, by broken classes."""

from __future__ import annotations

import asyncio
import contextlib
import importlib
import itertools
import os
import signal
import sys
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from examples import rest_thorough
from running_mission import RunningMission, mission_up

from backbone.bus.zenoh_bus import ZenohBus
from backbone.component.messages import MESSAGES_DROPPED, AskStatistics, Statistics
from backbone.errors import Refusal
from backbone.exchange import SwapModule, Swapped
from backbone.keys import Conversation
from mission_control.laboratory.module_kit.real_mission import BIN

pytestmark = [pytest.mark.processes, pytest.mark.timeout(300)]

WITHIN_S, MANY = 30.0, 100  # so many swaps are measured on a calm machine
EVERY_S = 1 / 30
TESTER, UNIT, FILE = "ui_console/tester", "mission_control/answering", "swapped_in_a_mission"
SOURCE = """
from backbone.wire import Message
from mission_control.modules.module import Module


class Asked(Message, frozen=True):
    number: int


class Answered(Message, frozen=True):
    number: int
    total: int
    who: str


class Answerer(Module):
    class Inputs(Module.Inputs):
        asked: Asked

    class Outputs(Module.Outputs):
        answered: Answered

    class Parameters(Module.Parameters, frozen=True):
        who: str = "first"

    class State(Module.State):
        total: int = 0

    state: State
    parameters: Parameters

    def update(self, inputs):
        self.state.total += inputs.asked.number
        return self.Outputs(Answered(inputs.asked.number, self.state.total, self.parameters.who))
"""
MISSION = f"""<mission name="m" priority="1"><modules>
<given key="asked" class="{FILE}:Asked" address="{TESTER}" conversation="events"/>
<unit name="answering" own-thread="{{thread}}"><module name="answerer" class="{FILE}:Answerer"/></unit>
</modules></mission>"""


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A module's file that the mission can import, and this process, too."""
    file = tmp_path / f"{FILE}.py"
    file.write_text(SOURCE)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.syspath_prepend(tmp_path)
    yield file
    sys.modules.pop(FILE, None)


@dataclass
class Talk:
    """Numbers at 30 Hz, and what is answered."""

    bus: ZenohBus
    classes: Any
    asked: int = 0
    answered: list[Any] = field(default_factory=list)
    news: asyncio.Event = field(default_factory=asyncio.Event)

    async def ask_on(self) -> None:
        while True:
            self.asked += 1
            self.bus.publish(TESTER, Conversation.EVENTS, self.classes.Asked(self.asked))
            await asyncio.sleep(EVERY_S)

    def heard(self, envelope: Any) -> None:
        self.answered.append(envelope.body)
        self.news.set()

    async def until_answered_by(self, who: str) -> None:
        async with asyncio.timeout(WITHIN_S):
            while not (self.answered and self.answered[-1].who == who):
                self.news.clear()
                await self.news.wait()

    async def swap(self, **fields: Any) -> Swapped:
        asked = SwapModule("answerer", f"{FILE}:Answerer", **fields)
        return await self.bus.ask(UNIT, asked, Swapped, within_s=WITHIN_S)

    def lost(self) -> int:
        """Return how many numbers have no answer; none may have two, and the sum of the rest must be known.

        A number without an answer is in the sum if its answer was lost on the way back: outputs are best effort.
        """
        numbers = [one.number for one in self.answered]
        assert len(numbers) == len(set(numbers)), "no answer is doubled"
        assert numbers == sorted(numbers)
        for before, after in itertools.pairwise(self.answered):
            possible = {after.number}
            for lost in range(before.number + 1, after.number):
                possible |= {one + lost for one in possible}
            assert after.total - before.total in possible, f"the state is kept: from {before} to {after}"
        return int(numbers[-1] - numbers[0] + 1 - len(numbers))

    async def overwritten(self) -> int:
        """Return how many numbers newer ones replaced, in the unit or on the bus, before the unit took them."""
        told = await self.bus.ask(UNIT, AskStatistics(), Statistics, within_s=WITHIN_S)
        counts = ("overwritten_asked", f"{MESSAGES_DROPPED}{TESTER}/{Conversation.EVENTS}")
        return int(sum(told.values.get(name, 0) for name in counts))


@asynccontextmanager
async def talk_with(mission: RunningMission) -> AsyncIterator[Talk]:
    async with mission.bus(TESTER) as bus:
        talk = Talk(bus, importlib.import_module(FILE))
        bus.subscribe(f"{UNIT}/answered", Conversation.OUTPUTS, talk.classes.Answered, talk.heard)
        asking = asyncio.create_task(talk.ask_on())
        try:
            await talk.until_answered_by("first")
            yield talk
        finally:
            asking.cancel()


@pytest.fixture
def mission(source: Path, tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[RunningMission]:
    file = tmp_path / "m.xml"
    file.write_text(MISSION.format(thread=getattr(request, "param", "false")))
    with mission_up(mission_xml=file) as up:
        yield up


def edit(source: Path, text: str) -> None:
    source.write_text(text)


async def command(mission: RunningMission, *words: str) -> Any:
    return await asyncio.to_thread(mission.command, "scout-backbone", *words, "--mission", mission.name)


async def test_a_person_exchanges_a_module_and_a_new_start_has_the_new_class(
    mission: RunningMission, source: Path
) -> None:
    async with talk_with(mission) as talk:
        edit(source, SOURCE.replace("inputs.asked.number, self", "inputs.asked.number, 0 + self"))
        words = ("swap", "answerer", f"{FILE}:Answerer", "--set", "who=second", "--prove", "0.5")
        done = await command(mission, *words)
        assert done.returncode == 0, done.stderr + mission.story()
        assert done.stdout.startswith(f"answerer: proved, {FILE}:Answerer goes on with the state of the old one")
        await talk.until_answered_by("second")
        assert talk.lost() <= 1 + await talk.overwritten()

        edit(source, SOURCE.replace("        self.state.total +=", "        raise OSError('no light')\n        x ="))
        done = await command(mission, *words[:3])
        assert done.returncode == 5, done.stdout
        assert "returned, the old one goes on" in done.stdout
        assert "OSError: no light" in done.stdout
        assert "OSError: no light" in mission.component("answering")["feedback"]
        said = (await command(mission, "log", "--robot", "answerer")).stdout
        assert said.count(f"exchanges it: for {FILE}:Answerer") == 2
        assert "OSError: no light" in said

        done = await command(mission, "swap", "answere", f"{FILE}:Answerer")
        assert done.returncode == 5
        assert "did you mean 'answerer'" in done.stderr

        edit(source, SOURCE)
        pid = mission.component("answering")["pid"]
        os.kill(pid, signal.SIGSTOP)
        done = await command(mission, *words[:3])
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)
        there = {one["pid"] for one in mission.status()["components"]}
        if pid in there:  # on a busy machine its creator may have replaced it already, or do so now
            assert done.returncode == 5
            assert "answering does not answer" in done.stderr

        talk.answered.clear()
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
        await talk.until_answered_by("second")


@pytest.mark.thorough
async def test_an_interrupted_command_says_that_the_exchange_goes_on_and_it_does(mission: RunningMission) -> None:
    async with talk_with(mission):
        words = ["swap", "answerer", f"{FILE}:Answerer", "--prove", "8", "--mission", mission.name]
        pipe = asyncio.subprocess.PIPE
        swapping = await asyncio.create_subprocess_exec(
            str(BIN / "scout-backbone"), *words, env=mission.environment, stdout=pipe, stderr=pipe
        )
        until = asyncio.get_running_loop().time() + WITHIN_S
        while "has to prove itself" not in mission.component("answering")["feedback"]:
            assert asyncio.get_running_loop().time() < until, mission.story()
            await asyncio.sleep(0.1)
        swapping.send_signal(signal.SIGINT)
        _out, told = await swapping.communicate()
        assert swapping.returncode == 130
        assert "goes on without this command" in told.decode()
        while "goes on with the state" not in mission.component("answering")["feedback"]:
            assert asyncio.get_running_loop().time() < until + 8, mission.story()
            await asyncio.sleep(0.1)


@pytest.mark.thorough
async def test_a_unit_that_is_killed_during_a_trial_is_back_with_the_old_class_and_the_story_tells_it(
    mission: RunningMission,
) -> None:
    async with talk_with(mission) as talk:
        words = ("swap", "answerer", f"{FILE}:Answerer", "--set", "who=second", "--prove", "60")
        swapping = asyncio.create_task(command(mission, *words))
        await talk.until_answered_by("second")
        os.kill(mission.component("answering")["pid"], signal.SIGKILL)
        done = await swapping
        assert (done.returncode, "answering ended" in done.stderr) == (5, True), done.stderr
        await talk.until_answered_by("first")
        assert "has to prove itself" in (await command(mission, "story", "answerer")).stdout
        assert "fell, " in (await command(mission, "story", "answering")).stdout


@pytest.mark.alone  # a machine that is full loses messages at 30 Hz without any swap, too
@pytest.mark.parametrize("mission", rest_thorough(["true", "false"]), indirect=True, ids=["in a thread", "in the loop"])
@pytest.mark.parametrize("count", [10, pytest.param(MANY, marks=pytest.mark.slow)])
async def test_swaps_at_thirty_hertz_lose_one_message_at_most(
    mission: RunningMission, source: Path, count: int
) -> None:
    async with talk_with(mission) as talk:
        for number in range(count):
            edit(source, SOURCE + f"\n\nEDITED = {number}\n")
            swapped = await talk.swap(parameters={"who": str(number)}, prove_s=0.1)
            assert (swapped.is_proved, swapped.keeps_state) == (True, True), swapped.cause
            await talk.until_answered_by(str(number))
        replaced = await talk.overwritten()
        assert talk.lost() <= 1 + (replaced if count < MANY else 0)
        assert replaced <= 1 or count < MANY, "the machine delayed the few swaps, or the many cost more than a message"


BROKEN = {
    "in its text": ("class Answerer(Module):", "class Answerer(Module:", "SyntaxError"),
    "when it is made": (
        "    def update",
        "    def is_ready(self):\n        return 1 / 0\n\n    def update",
        "ZeroDivision",
    ),
    "at work": ("        return", "        raise ValueError('planted')\n        return", "planted"),
    "by another class": ("return self.Outputs(", "return (", "not its Outputs"),
}


@pytest.mark.parametrize("times", rest_thorough([1, 5]))
async def test_swaps_to_broken_classes_leave_the_old_one_and_name_the_cause(
    mission: RunningMission, source: Path, times: int
) -> None:
    async with talk_with(mission) as talk:
        for _ in range(times):
            for old, new, cause in BROKEN.values():
                edit(source, SOURCE.replace(old, new))
                try:
                    swapped = await talk.swap(parameters={"who": "broken"}, prove_s=0.1)
                    assert not swapped.is_proved
                    told = swapped.cause
                except Refusal as refusal:
                    told = refusal.detail
                assert cause in told
        assert talk.lost() <= 1 + await talk.overwritten()
        assert {one.who for one in talk.answered} == {"first"}
