"""Behaviors whose processes are killed carry on where they were, as after a suspension."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import time
from pathlib import Path

import pytest
from running_mission import RunningMission, mission_up

from backbone.errors import LinkError
from backbone.keys import Conversation
from mission_control.messages import AskBehavior, BehaviorState, BehaviorStatus, WaypointReached

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

GO_TO = Path(__file__).parents[2] / "docs" / "examples" / "go-to.xml"
FOLLOWS = 'type="follow" name="follow-scout1"'
PATROLS = 'type="patrol" name="patrol-scout2"'
WITHIN_S = 90.0


def kill(mission: RunningMission, name: str) -> None:
    os.kill(mission.component(name)["pid"], signal.SIGKILL)


@pytest.mark.thorough
async def test_a_killed_patrol_and_a_killed_errand_carry_on_where_they_were(tmp_path: Path) -> None:
    """The errand once went out again, and the patrol began at its first way point."""
    mission_xml = tmp_path / "killed.xml"
    text = GO_TO.read_text(encoding="utf-8")
    for before, after in [
        (FOLLOWS, PATROLS),
        ('<parameter name="target" value="scout1"/>', '<parameter name="waypoints" value="1,3 1.6,3 1,3.5"/>'),
        ('<parameter name="distance_m" value="0.6"/>', '<parameter name="reached_within_m" value="0.15"/>'),
    ]:
        assert text.count(before) == 1
        text = text.replace(before, after)
    mission_xml.write_text(text, encoding="utf-8")
    reached: list[int] = []
    goes_home = asyncio.Event()
    with mission_up(mission_xml=mission_xml) as mission:
        async with mission.bus() as bus:
            bus.subscribe(
                "mission_control/patrol-scout2",
                Conversation.EVENTS,
                WaypointReached,
                lambda heard: reached.append(heard.body.number),
            )
            bus.watch_alive("mission_control/go-home", lambda _address, alive: goes_home.set() if alive else None)
            patrol_kills, errand_is_killed, errand, ends_s = (
                0,
                False,
                BehaviorStatus.RUNNING,
                time.monotonic() + WITHIN_S,
            )
            while not (errand.is_final and len(reached) > 5):
                assert time.monotonic() < ends_s, (reached, errand, mission.story())
                if patrol_kills < 2 and len(reached) == 2 * (patrol_kills + 1):
                    kill(mission, "patrol-scout2")
                    patrol_kills += 1
                if goes_home.is_set() and not errand_is_killed:
                    kill(mission, "errand")
                    kill(mission, "go-home")
                    errand_is_killed = True
                    await asyncio.to_thread(mission.wait_for_line, "errand: fell", WITHIN_S)
                await asyncio.sleep(0.2)
                with contextlib.suppress(LinkError):  # it is being restarted
                    asked = await bus.ask("mission_control/errand", AskBehavior(), BehaviorState, within_s=2)
                    errand = asked.status
        story = mission.story()
        assert reached[:6] == [1, 2, 3, 4, 5, 6], story
        assert (errand, patrol_kills, mission.component("errand")["restarts"]) == (BehaviorStatus.SUCCESS, 2, 1), story
        assert story.count("go-out: finished: success") == 1, story
