"""A localizer on a machine that is cut off for so long that all ends there knows the robots when it is back."""

from __future__ import annotations

import asyncio
import math
import re
import time
from pathlib import Path

import pytest
from namespaces import NetworkHost
from test_go_to_mission import GO_TO
from three_hosts import NAME, ThreeHosts, mission_on_three_hosts, types_on

from backbone.creator.messages import CUT_OFF_ENDS_WITHIN_S
from backbone.errors import LinkError
from resource_pool.localization import AskPose, Pose

pytestmark = [pytest.mark.processes, pytest.mark.thorough, pytest.mark.timeout(240)]

FIRST, SECOND, ROBOT = "localizer", "second", "scout1"
DRIVING = types_on(inside="sequence wait go_to return_home follow drive")


def two_localizers(hosts: dict[str, NetworkHost]) -> str:
    """Return ``go-to.xml`` for three machines, with nothing on far but a second localizer."""
    text = re.sub(r'(<mission[^>]*?\bname=")[^"]*', rf"\g<1>{NAME}", GO_TO.read_text(encoding="utf-8"), count=1)
    machines = "".join(
        f'<host name="{name}" address="{host.address}" tags="{"outside" if name == "far" else "inside"}"/>'
        for name, host in hosts.items()
    )
    text = re.sub(r'(<resource [^>]*?) process="hardware"', r'\1 host="base"', text)
    for before, after in [
        ('<world seed="1">', '<world seed="1" host="base">'),
        ("<resources>", f"{DRIVING}<hosts>{machines}</hosts><resources>"),
        ("</resources>", f'<resource type="localizer" name="{SECOND}" host="far"/></resources>'),
    ]:
        assert text.count(before) == 1
        text = text.replace(before, after)
    return text


async def poses(mission: ThreeHosts, *localizers: str) -> list[Pose]:
    """Return the robot's pose as each localizer has it; empty: one does not answer."""
    async with mission.bus() as bus:
        try:
            return [await bus.ask(f"resource_pool/{one}", AskPose(ROBOT), Pose, within_s=1) for one in localizers]
        except LinkError:
            return []


def metres_between(one: Pose, other: Pose) -> float:
    return math.dist((one.x_m, one.y_m), (other.x_m, other.y_m))


def test_a_localizer_that_is_back_after_a_long_cut_has_all_motions(short_path: Path) -> None:
    """All robots were at unknown places."""
    with mission_on_three_hosts(short_path, text=two_localizers, arcs={"go-out-drive"}) as mission:
        [before] = asyncio.run(poses(mission, FIRST))
        mission.hosts["far"].cut()
        time.sleep(CUT_OFF_ENDS_WITHIN_S + 1.0)
        [then] = asyncio.run(poses(mission, FIRST))
        assert metres_between(before, then) > 0.3, ("it did not move meanwhile", mission.story())
        mission.hosts["far"].heal()
        mission.wait("the second localizer answers", lambda: asyncio.run(poses(mission, SECOND)) != [], 60.0)
        first, second = asyncio.run(poses(mission, FIRST, SECOND))
        assert metres_between(first, second) < 0.05, (first, second, mission.story())
        assert second.spread_m < first.spread_m + 0.05, (first, second)
