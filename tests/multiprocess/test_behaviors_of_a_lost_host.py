"""Behaviors of a machine that is cut off carry on where they were, on another machine."""

from __future__ import annotations

import asyncio
import re
import time
from pathlib import Path

import pytest
from namespaces import NetworkHost
from test_go_to_mission import GO_TO
from three_hosts import NAME, mission_on_three_hosts, types_on

from backbone.keys import Conversation
from mission_control.messages import WaypointReached

pytestmark = [pytest.mark.processes, pytest.mark.thorough, pytest.mark.timeout(300)]

PATROL = "patrol-scout2"
DRIVING = types_on(outside="sequence wait go_to return_home patrol drive")
WITHIN_S = 120.0


def with_a_patrol(hosts: dict[str, NetworkHost]) -> str:
    """Return ``go-to.xml`` for three machines: all resources on base, and a patrol in place of the follower."""
    text = re.sub(r'(<mission[^>]*?\bname=")[^"]*', rf"\g<1>{NAME}", GO_TO.read_text(encoding="utf-8"), count=1)
    machines = "".join(
        f'<host name="{name}" address="{host.address}" tags="{"inside" if name == "base" else "outside"}"/>'
        for name, host in hosts.items()
    )
    text = re.sub(r'(<resource [^>]*?) process="hardware"', r'\1 host="base"', text)
    for before, after in [
        ("<resources>", f"{DRIVING}<hosts>{machines}</hosts><resources>"),
        ('type="follow" name="follow-scout1"', f'type="patrol" name="{PATROL}"'),
        ('<parameter name="target" value="scout1"/>', '<parameter name="waypoints" value="1,3 1.6,3 1,3.5"/>'),
        ('<parameter name="distance_m" value="0.6"/>', '<parameter name="reached_within_m" value="0.15"/>'),
    ]:
        assert text.count(before) == 1
        text = text.replace(before, after)
    return text


def test_a_patrol_continues_on_another_machine_with_the_next_way_point(short_path: Path) -> None:
    with mission_on_three_hosts(short_path, text=with_a_patrol, arcs={f"{PATROL}-drive"}) as mission:
        before = mission.components()[PATROL].host
        assert before != "base"
        reached: list[int] = []

        async def scene() -> None:
            async with mission.bus() as bus:
                bus.subscribe(
                    f"mission_control/{PATROL}",
                    Conversation.EVENTS,
                    WaypointReached,
                    lambda heard: reached.append(heard.body.number),
                )
                ends_s, is_cut, begin = time.monotonic() + WITHIN_S, False, 2
                while len(reached) < begin + 4:
                    assert time.monotonic() < ends_s, (reached, mission.story())
                    if len(reached) >= begin and not is_cut:
                        mission.hosts[before].cut()
                        is_cut = True
                    await asyncio.sleep(0.1)

        asyncio.run(scene())
        assert mission.components()[PATROL].host != before
        assert reached == [*range(reached[0], reached[0] + len(reached))], mission.story()
        mission.hosts[before].heal()
        mission.wait("the machine is back", lambda: f"creator-{before}" in mission.components(), 60.0)
