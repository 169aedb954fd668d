"""A mission in few processes: up --pack N, and the mission file says nothing of processes."""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path

import pytest
from running_mission import MISSION_XML, mission_up

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]


def test_a_mission_without_a_process_in_its_file_runs_in_two_packs(tmp_path: Path) -> None:
    file = tmp_path / "mission.xml"
    file.write_text(re.sub(r' process="[a-z]+"', "", MISSION_XML.read_text()))
    with mission_up("--pack", "2", mission_xml=file) as mission:
        mission.wait_for_components("watch-scout1", "watch-scout2")
        components = mission.status()["components"]
        there = [one for one in components if one["subsystem"] in ("resource_pool", "mission_control")]
        members: dict[int, set[str]] = defaultdict(set)
        for one in there:
            members[one["pid"]].add(one["type"])
        alone = [types for types in members.values() if types <= {"simulated_world", "framegrabber"}]
        assert len(alone) == 2
        assert len(members) == 4
        assert {"radio", "watch-scout1"} <= {one["name"] for one in there}
        core = {one["name"]: one["pid"] for one in components if one["subsystem"] == "backbone"}
        packed = ("component_database", "placer", "dependency_database", "rc_manager")
        assert len({core[name] for name in packed}) == 1
        assert len({core["rc_manager"], core["nameserver"], core["creator-base"], core["launcher"]} & set(members)) == 0
        assert len(set(core.values())) == 4
