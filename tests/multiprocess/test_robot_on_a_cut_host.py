"""A robot whose RC runs on a machine that is cut off is at a known place when its next RC runs on another one."""

from __future__ import annotations

import asyncio
import math
import re
import time
from functools import partial
from pathlib import Path

import pytest
from namespaces import NetworkHost
from test_go_to_mission import GO_TO
from three_hosts import NAME, ThreeHosts, mission_on_three_hosts, types_on

from backbone.errors import LinkError
from resource_pool.localization import AskPose, Pose

pytestmark = [pytest.mark.processes, pytest.mark.thorough, pytest.mark.timeout(240)]

ROBOT, WORLD, LOCALIZER = "scout1", "world", "localizer"
TYPES = types_on(field="scout", indoors="sequence wait patrol return_home follow drive")
TAGS = {"base": "indoors", "near": "field", "far": "field"}
KNOWN_M = 0.3  # chosen: a time of 2 s without motions is a spread of 0.4 m


def robots_in_the_field(hosts: dict[str, NetworkHost]) -> str:
    """Return ``go-to.xml`` for three machines: RCs of robots on near or far, other resources on base, and a patrol."""
    text = re.sub(r'(<mission[^>]*?\bname=")[^"]*', rf"\g<1>{NAME}", GO_TO.read_text(encoding="utf-8"), count=1)
    machines = "".join(
        f'<host name="{name}" address="{host.address}" tags="{TAGS[name]}"/>' for name, host in hosts.items()
    )
    text = re.sub(r'(type="scout" name="\w+") process="hardware"', r"\1", text)
    for before, after in [
        (' process="hardware"', ' host="base"'),
        ('<world seed="1">', '<world seed="1" host="base">'),
        ("<resources>", f"{TYPES}<hosts>{machines}</hosts><resources>"),
        ('type="go_to" name="go-out"', 'type="patrol" name="go-out"'),
        ('<parameter name="x_m" value="3"/>', '<parameter name="waypoints" value="3,2 1,1"/>'),
        ('<parameter name="y_m" value="2"/>', ""),
    ]:
        text = text.replace(before, after)
    return text


async def pose(mission: ThreeHosts, source: str) -> Pose | None:
    """Return the robot's pose; None: the source does not answer."""
    async with mission.bus() as bus:
        try:
            return await bus.ask(f"resource_pool/{source}", AskPose(ROBOT), Pose, within_s=1)
        except LinkError:
            return None


def test_it_is_at_a_known_place_there_and_when_its_rc_is_back(short_path: Path) -> None:
    """It was at an unknown place, and its behavior failed: all the time until the cut was seen counted as unknown."""

    def host() -> str:
        found = mission.components().get(ROBOT)
        return found.host if found is not None and found.state == "ready" else ""

    def is_at(hosts: set[str]) -> bool:
        return host() in hosts

    def has_creator(name: str) -> bool:
        return f"creator-{name}" in mission.components()

    def drives() -> bool:
        first = asyncio.run(pose(mission, WORLD))
        time.sleep(0.5)
        then = asyncio.run(pose(mission, WORLD))
        if first is None or then is None:
            return False
        return math.dist((first.x_m, first.y_m), (then.x_m, then.y_m)) > 0.03

    with mission_on_three_hosts(short_path, text=robots_in_the_field, arcs={"go-out-drive"}) as mission:
        for _ in range(2):
            mission.wait("the robot drives", drives, 60.0)
            here = host()
            others = {"near", "far"} - {here}
            assert len(others) == 1
            mission.hosts[here].cut()
            mission.wait("its RC is elsewhere", partial(is_at, others), 60.0)
            mission.wait("it drives again", drives, 60.0)
            believed, true = (asyncio.run(pose(mission, source)) for source in (LOCALIZER, WORLD))
            assert believed is not None
            assert true is not None
            apart_m = math.dist((believed.x_m, believed.y_m), (true.x_m, true.y_m))
            assert max(apart_m, believed.spread_m) < KNOWN_M, mission.story()
            mission.hosts[here].heal()
            mission.wait("the machine is back", partial(has_creator, here), 60.0)
