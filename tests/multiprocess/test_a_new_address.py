"""The address of a machine changes while behaviors there receive pictures: all components answer again."""

from __future__ import annotations

import asyncio
import re
import time
from pathlib import Path

import pytest
from namespaces import SUBNET, NetworkHost
from three_hosts import ThreeHosts, mission_on_three_hosts, mission_text

from backbone.component.messages import AskState, ComponentState
from backbone.errors import LinkError
from backbone.mission.shipped_types import shipped_text

pytestmark = [pytest.mark.processes, pytest.mark.thorough, pytest.mark.alone, pytest.mark.timeout(400)]

WATCHERS = ("mission_control/watch-scout1", "mission_control/watch-scout2")
CHANGES = 4  # of six in seven, one left a watcher without messages
UNDISTURBED_S = 3.5  # longer than the lease: a question to a host out of reach makes the hub end its link sooner
ANSWERED_WITHIN_S = 20.0


def with_watchers_on_far_and_their_arcs_on_near(hosts: dict[str, NetworkHost]) -> str:
    """Return the mission so that no message between a watcher and its ARC stays on one machine."""
    text = mission_text(hosts)
    for name in ("near", "far"):
        text = re.sub(rf'(<host name="{name}"[^>]*tags=")', rf"\g<1>{name}side ", text)
    types = ""
    for name, tag in (("watch_for_motion", "farside"), ("capture", "nearside")):
        found = re.search(rf'<type name="{name}"[^>]*?(/>|>.*?</type>)', shipped_text().decode(), re.DOTALL)
        assert found is not None
        types += found[0].replace("<type", f'<type tags="{tag}"', 1)
    return text.replace("<resources>", f"<types>{types}</types><resources>", 1)


async def answer(mission: ThreeHosts) -> bool:
    try:
        async with mission.bus() as bus:
            for watcher in WATCHERS:
                await bus.ask(watcher, AskState(), ComponentState, within_s=2.0)
    except LinkError:
        return False
    return True


def pictures(mission: ThreeHosts) -> int:
    """Return how many pictures the watcher has received whose turn it is; 0: neither has its turn."""
    said = [component.feedback for component in mission.components().values() if component.address in WATCHERS]
    return sum(int(found[1]) for line in said if (found := re.match(r"watching through \S+: (\d+)", line)))


def watch_on(mission: ThreeHosts) -> None:
    """Return in the middle of the turn of one watcher."""
    mission.wait("a watcher has its turn", lambda: pictures(mission) > 0, 20.0)
    before = pictures(mission)
    mission.wait("it receives pictures", lambda: pictures(mission) > before, 20.0)


def test_a_machine_whose_address_changes_has_no_deaf_component(short_path: Path) -> None:
    with mission_on_three_hosts(short_path, text=with_watchers_on_far_and_their_arcs_on_near) as mission:
        there = mission.components()
        assert [there[name].host for name in ("watch-scout1", "watch-scout1-capture")] == ["far", "near"]
        for change in range(CHANGES):
            watch_on(mission)
            mission.hosts["far"].change_address(f"{SUBNET}.{33 + change}")
            time.sleep(UNDISTURBED_S)
            took_s = mission.wait("the watchers answer", lambda: asyncio.run(answer(mission)), ANSWERED_WITHIN_S)
            print(f"change {change}: the watchers answer after {took_s:.1f} s")
            mission.wait("the mission is whole", mission.is_whole, ANSWERED_WITHIN_S)
