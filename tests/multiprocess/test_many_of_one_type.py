"""Many components of one type in a real mission: the first have their own processes, the others share one."""

from __future__ import annotations

import os
import signal
import time
from collections import defaultdict
from pathlib import Path

import pytest
from running_mission import RunningMission, mission_up

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

RECEIVERS, OWN = 19, 16
BACK_WITHIN_S = 20.0
MISSION = f"""<mission name="receivers" priority="1">
  <hosts><host name="base" address="127.0.0.1"/></hosts>
  <resources>
    {"".join(f'<resource type="video_frequency" name="video{number}"/>' for number in range(RECEIVERS))}
  </resources>
  <world name="world" host="base"><room width-m="5" depth-m="5"/></world>
</mission>"""


def shared(mission: RunningMission) -> tuple[int, set[str]]:
    """Return the process with several receivers and their names; every other receiver is alone."""
    members: dict[int, set[str]] = defaultdict(set)
    for one in mission.status()["components"]:
        if one["type"] == "video_frequency" and one["state"] == "ready":
            members[one["pid"]].add(one["name"])
    together = [(pid, names) for pid, names in members.items() if len(names) > 1]
    assert len(together) <= 1, members
    return together[0] if together else (0, set())


def test_the_receivers_beyond_the_first_share_a_process_and_come_back_together(tmp_path: Path) -> None:
    file = tmp_path / "mission.xml"
    file.write_text(MISSION)
    with mission_up(mission_xml=file) as mission:
        pid, names = shared(mission)
        assert len(names) == RECEIVERS - OWN
        os.kill(pid, signal.SIGKILL)
        ends_s = time.monotonic() + BACK_WITHIN_S
        while (again := shared(mission))[1] != names or again[0] == pid:
            assert time.monotonic() < ends_s, f"{names} are not back: {mission.status()}"
            time.sleep(0.05)


@pytest.mark.thorough
def test_each_receiver_has_its_own_process_where_that_is_asked_for(tmp_path: Path) -> None:
    file = tmp_path / "mission.xml"
    file.write_text(MISSION)
    with mission_up("--pack", "0", mission_xml=file) as mission:
        assert shared(mission) == (0, set())
