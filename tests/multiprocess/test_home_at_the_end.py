"""The last branch of a mission on real processes: what ends with it, and that nothing is left."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
from pathlib import Path
from typing import Any

import pytest
from running_mission import BIN, RunningMission, mission_up, status_when_settled

from backbone.component.messages import AskState, ComponentState
from backbone.keys import Conversation
from backbone.wire import Envelope
from mission_control.messages import AskBehavior, BehaviorState, WaypointReached
from resource_pool.stop_messages import EmergencyStop, StopState

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

HOME_AT_THE_END = Path(__file__).parents[2] / "docs" / "examples" / "home-at-the-end.xml"
RUNS = "last branch end-of-day runs, for at most 60 s"


def patrols(mission: RunningMission) -> None:
    mission.wait_for_line("runs: patrol-drive", 20.0)


def drives_home(mission: RunningMission) -> None:
    mission.wait_for_line("runs: drive-home-drive", 20.0)


@pytest.mark.thorough
async def test_down_has_the_scout_drive_home_and_leaves_nothing() -> None:
    with mission_up(mission_xml=HOME_AT_THE_END) as mission:
        patrols(mission)
        names = {one["name"] for one in mission.status()["components"]}
        assert not {"end-of-day", "drive-home"} & names
        assert mission.component("launcher")["feedback"] == "all ready; at the end: end-of-day"
        status_when_settled(mission)
        reached = asyncio.Event()

        def hear(_event: Envelope[Any]) -> None:
            reached.set()

        async with mission.bus() as bus:
            bus.subscribe("mission_control/drive-home", Conversation.EVENTS, WaypointReached, hear)
            going = asyncio.create_task(asyncio.to_thread(mission.command, "scout-backbone", "down"))
            await asyncio.to_thread(drives_home, mission)
            tree = (await bus.ask("mission_control/end-of-day", AskBehavior(), BehaviorState, within_s=2)).tree
            health = (await bus.ask("resource_pool/scout1", AskState(), ComponentState, within_s=2)).state
            down = await going
        assert tree.startswith("end-of-day (timeout, priority 1): last branch; running; "), tree
        assert health == "ready"
        assert reached.is_set(), mission.story()
        assert down.returncode == 0, down.stderr
        assert RUNS in down.stderr
        assert "last branch end-of-day: succeeded after " in down.stderr
        assert "is down; asking was enough" in down.stderr
        assert mission.launcher.wait(30) == 0, mission.story()


@pytest.mark.thorough
def test_it_gets_the_robot_that_a_person_holds() -> None:
    with mission_up(mission_xml=HOME_AT_THE_END) as mission:
        patrols(mission)
        words = ["scout-console", "attach", "scout1", "--priority", "100", "--mission", mission.name, "--script", "-"]
        console = subprocess.Popen(
            [str(BIN / words[0]), *words[1:]],
            env=mission.environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            mission.wait_for_line("scout1: was taken over by", 20.0)
            down = mission.command("scout-backbone", "down")
            assert "last branch end-of-day: succeeded after " in down.stderr, mission.story()
            assert mission.launcher.wait(30) == 0, mission.story()
            console.wait(10)
        finally:
            console.kill()
            console.communicate()


@pytest.mark.thorough
def test_a_second_down_ends_it_at_once() -> None:
    with mission_up(mission_xml=HOME_AT_THE_END) as mission:
        patrols(mission)
        mission.launcher.send_signal(signal.SIGINT)  # as Ctrl-C
        drives_home(mission)
        down = mission.command("scout-backbone", "down", within_s=30.0)
        assert "last branch end-of-day: ended by a second order after " in down.stderr
        assert down.returncode == 0, down.stderr
        assert mission.launcher.wait(30) == 0, mission.story()


@pytest.mark.thorough
def test_down_now_does_without_it() -> None:
    with mission_up(mission_xml=HOME_AT_THE_END) as mission:
        patrols(mission)
        down = mission.command("scout-backbone", "down", "--now", within_s=30.0)
        assert "last branch end-of-day: skipped, as ordered" in down.stderr
        assert (down.returncode, mission.launcher.wait(30)) == (0, 0), mission.story()
        assert not any("drive-home" in line for line in mission.lines)


@pytest.mark.thorough
def test_sigterm_runs_it_and_a_second_one_ends_it() -> None:
    with mission_up(mission_xml=HOME_AT_THE_END) as mission:
        patrols(mission)
        mission.launcher.send_signal(signal.SIGTERM)
        drives_home(mission)
        mission.launcher.send_signal(signal.SIGTERM)
        assert mission.launcher.wait(30) == 0, mission.story()
        mission.wait_for_line("last branch end-of-day: ended by a second order", 1.0)


@pytest.mark.thorough
def test_a_launcher_that_is_killed_meanwhile_leaves_nothing() -> None:
    with mission_up(mission_xml=HOME_AT_THE_END) as mission:
        patrols(mission)
        mission.launcher.send_signal(signal.SIGTERM)
        drives_home(mission)
        mission.launcher.kill()
        mission.launcher.wait(10)


@pytest.mark.thorough
async def test_a_robot_that_is_stopped_holds_the_end_up_for_the_branchs_time_only() -> None:
    with mission_up(mission_xml=HOME_AT_THE_END, change={'within-s="60"': 'within-s="3"'}) as mission:
        patrols(mission)
        async with mission.bus() as bus:
            await bus.ask("resource_pool/scout1", EmergencyStop("a test", "safety"), StopState, within_s=5)
        down = mission.command("scout-backbone", "down", within_s=40.0)
        assert "last branch end-of-day: was not done: its time is over after 3" in down.stderr
        assert "is down; asking was enough" in down.stderr
        assert mission.launcher.wait(30) == 0, mission.story()


NEVER_MADE = """
from mission_control.behavior import Behavior


class NeverMade(Behavior):
    def __init__(self, launch, bus, clock):
        super().__init__(launch, bus, clock)
        raise RuntimeError("never")
"""


@pytest.mark.thorough
def test_a_branch_that_cannot_start_holds_nothing_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "never_made.py").write_text(NEVER_MADE)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    text, own = HOME_AT_THE_END.read_text(), "never_made:NeverMade"
    kind = f'<types><type name="never-made" class="{own}" subsystem="mission_control"/></types><resources>'
    head, tail = text.partition("<last")[0].replace("<resources>", kind), text.partition("</last>")[2]
    file = tmp_path / "mission.xml"
    file.write_text(f'{head}<last><behavior type="never-made" name="end-of-day" priority="1"/></last>{tail}')
    with mission_up(mission_xml=file) as mission:
        patrols(mission)
        down = mission.command("scout-backbone", "down", within_s=30.0)
        assert "last branch end-of-day: could not be started: " in down.stderr
        assert mission.launcher.wait(30) == 0, mission.story()
