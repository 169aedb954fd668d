"""A patrol and the driver of its radio are exchanged in a real mission: the grant stays, the robot drives on."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from running_mission import RunningMission, mission_up

from backbone.bus.zenoh_bus import ZenohBus
from backbone.component.messages import AskStatistics, Statistics
from backbone.errors import Refusal
from backbone.exchange import SwapClass, Swapped
from backbone.keys import Conversation
from backbone.rc_manager.messages import AskRc, RcState
from backbone.wire import Envelope
from mission_control.messages import WaypointReached

pytestmark = [pytest.mark.processes, pytest.mark.timeout(300)]

WITHIN_S = 30.0
TESTER, PATROL, FILE = "ui_console/tester", "mission_control/round", "swapped_patrol"
SOURCE = """
from mission_control.behaviors.patrol import Patrol
from resource_pool.drivers.simulated import SimulatedRadio


class Round(Patrol):
    async def drive_on(self, robot):
        await super().drive_on(robot)


class Second(Round):
    def statistics(self):
        return super().statistics() | {"second": 1.0}


class Radio(SimulatedRadio):
    async def transmit(self, network_id, payload, **who):
        return await super().transmit(network_id, payload, **who)
"""
MISSION = f"""<mission name="m" priority="1">
<types><type name="round" class="{FILE}:Round" subsystem="mission_control"/></types>
<resources>
  <resource type="command_radio" name="radio" sharable="true"/>
  <resource type="scout" name="scout1">
    <uses type="command_radio" name="radio"/><parameter name="network_id" value="1"/>
  </resource>
</resources>
<world seed="1"><room width-m="6" depth-m="4"/><robot name="scout1" x-m="1" y-m="1"/></world>
<behaviors>
  <behavior type="round" name="round" priority="3">
    <parameter name="waypoints" value="1,1 1.3,1 1.3,1.3 1,1.3"/><parameter name="localizer" value="world"/>
    <arc kind="drive" minimum-runtime-s="5"><wish type="scout" name="scout1"/></arc>
  </behavior>
</behaviors></mission>"""
ACT = "    async def drive_on"
BROKEN = [
    ("class Round(Patrol):", "class Round(Patrol:", "SyntaxError"),
    ("        await super()", "        raise OSError('no way')\n        await super()", "no way"),
    (
        "    async def drive_on",
        "    def is_ready(self):\n        return 1 / 0\n\n    async def drive_on",
        "ZeroDivision",
    ),
    ("class Round(Patrol):", "class Round(Patrol):\n    def need(self):\n        return None\n", "another ARC"),
]


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    file = tmp_path / f"{FILE}.py"
    file.write_text(SOURCE)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.syspath_prepend(tmp_path)
    yield file
    sys.modules.pop(FILE, None)


@pytest.fixture
def mission(source: Path, tmp_path: Path) -> Iterator[RunningMission]:
    file = tmp_path / "m.xml"
    file.write_text(MISSION)
    with mission_up("--trace", str(tmp_path / "trace"), mission_xml=file) as up:
        yield up


async def swap(bus: ZenohBus, at: str, kind: str, prove_s: float = 0.2) -> Swapped:
    return await bus.ask(at, SwapClass(f"{FILE}:{kind}", {}, prove_s), Swapped, within_s=WITHIN_S)


async def epochs(bus: ZenohBus) -> list[int]:
    state = await bus.ask("resource_pool/scout1", AskRc(), RcState, within_s=5.0)
    return [holder.epoch for holder in state.holders]


async def statistics(bus: ZenohBus, at: str) -> dict[str, float]:
    return (await bus.ask(at, AskStatistics(), Statistics, within_s=5.0)).values


class Visits:
    """Way points that are reached."""

    def __init__(self, bus: ZenohBus) -> None:
        self.numbers: list[int] = []
        self._news = asyncio.Event()
        bus.subscribe(PATROL, Conversation.EVENTS, WaypointReached, self._heard)

    def _heard(self, envelope: Envelope[WaypointReached]) -> None:
        self.numbers.append(envelope.body.number)
        self._news.set()

    async def more(self, count: int) -> None:
        """Return when so many more are reached."""
        until = len(self.numbers) + count
        async with asyncio.timeout(120.0):
            while len(self.numbers) < until:
                self._news.clear()
                await self._news.wait()


def edit(source: Path, text: str) -> None:
    source.write_text(text)


@pytest.mark.thorough
async def test_a_patrol_is_exchanged_a_hundred_times_and_twenty_broken_ones_leave_it(
    mission: RunningMission, source: Path, judged: Callable[[Path], None]
) -> None:
    async with mission.bus(TESTER) as bus:
        visits = Visits(bus)
        await visits.more(1)
        [epoch] = await epochs(bus)
        for number in range(100):
            edit(source, SOURCE + f"\n\nEDITED = {number}\n")
            swapped = await swap(bus, PATROL, "Round")
            assert (swapped.is_proved, swapped.keeps_state) == (True, True), swapped.cause
        for _ in range(5):
            for old, new, cause in BROKEN:
                edit(source, SOURCE.replace(old, new))
                try:
                    swapped = await swap(bus, PATROL, "Round")
                    assert not swapped.is_proved
                    told = swapped.cause
                except Refusal as refusal:
                    told = refusal.detail
                assert cause in told
        await visits.more(2)
        assert await epochs(bus) == [epoch], "the grant is the same"
        numbers = visits.numbers
        assert numbers == list(range(numbers[0], numbers[0] + len(numbers))), "no way point is lost or doubled"
        robot = await statistics(bus, "resource_pool/scout1")
        assert (robot["refused_stale"], robot["connects"]) == (0, 1)
    judged(source.parent / "trace")


@pytest.mark.thorough
async def test_a_person_exchanges_a_behavior_and_a_driver_and_new_starts_have_them(
    mission: RunningMission, source: Path
) -> None:
    async def command(*words: str) -> Any:
        return await asyncio.to_thread(mission.command, "scout-backbone", *words, "--mission", mission.name)

    async with mission.bus(TESTER) as bus:
        visits = Visits(bus)
        await visits.more(1)
        grant = await epochs(bus)
        done = await command("swap", "round", f"{FILE}:Second", "--prove", "0.5")
        assert done.returncode == 0, done.stderr + mission.story()
        assert "round: proved" in done.stdout
        assert "state of the old one" in done.stdout
        done = await command("swap", "radio", f"{FILE}:Radio", "--prove", "0.5")
        assert done.returncode == 0, done.stderr + mission.story()
        assert await epochs(bus) == grant
        sent = (await statistics(bus, "resource_pool/radio"))["packets_sent"]
        edit(source, SOURCE.replace("        return await", "        raise OSError('no mast')\n        return await"))
        done = await command("swap", "radio", f"{FILE}:Radio", "--prove", "0.5")
        assert done.returncode == 5
        assert "OSError: no mast" in done.stdout
        assert await epochs(bus) == grant
        assert (await statistics(bus, "resource_pool/radio"))["packets_sent"] > sent
        done = await command("swap", "radoi", f"{FILE}:Radio")
        assert (done.returncode, "did you mean 'radio'" in done.stderr) == (5, True)
        done = await command("swap", "world", f"{FILE}:Radio")
        assert (done.returncode, "no module, behavior or resource" in done.stderr) == (5, True)

        edit(source, SOURCE)
        pid = mission.component("round")["pid"]
        os.kill(pid, signal.SIGSTOP)
        try:
            done = await command("swap", "round", f"{FILE}:Round")
            assert done.returncode == 5, done.stdout
            assert "does not answer" in done.stderr
        finally:
            with contextlib.suppress(ProcessLookupError):  # its creator may have replaced it by then
                os.kill(pid, signal.SIGKILL)  # without SIGCONT, after which it might reach another way point
        visits.numbers.clear()
        await visits.more(1)
        assert (await statistics(bus, PATROL))["second"] == 1.0, "its next life has the new class"
