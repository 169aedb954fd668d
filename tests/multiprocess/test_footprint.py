"""What a mission takes of the machine stays what it was, also among those who send nonsense to everybody."""

from __future__ import annotations

import itertools
import subprocess
import sys
import time
from collections.abc import Iterator

import psutil
import pytest
import zenoh
from footprint import Footprint, footprint, grown
from hostile_messages import hostile_messages
from running_mission import RunningMission, mission_up

from backbone.bus.zenoh_bus import client_config
from backbone.keys import Conversation, key

pytestmark = pytest.mark.processes

WARM_UP_S, HOSTILE_S = 180.0, 180.0  # a renderer grows with the views that it draws, for three minutes
LOG_KB = 2 * 1024 + 256  # a log and the one before it, each a little over its size
CREATOR_MIB = 60.0  # of a small computer with half a gigabyte, a tenth
CORE, CORE_S = "backbone.component.process", 0.3  # all that a component's process needs before its own class
FEW_BYTES = 10_000  # the big ones are for a test of their own; here it is many that counts


@pytest.mark.thorough
def test_of_every_process_of_a_mission_there_is_a_footprint() -> None:
    with mission_up() as mission:
        pids = {c["pid"] for c in mission.status()["components"] if "cli-" not in c["name"]}
        found = footprint(mission)
        assert pids < {one.pid for one in found.values()}, sorted(found)
        assert {"launcher", "nameserver", "rc_manager", "zygote of launcher"} < set(found), sorted(found)
        served = [one for one in found.values() if one.pid in pids]  # a process forked just now takes nearly nothing
        assert all(one.memory_kb > 1000 and one.descriptors > 2 and one.threads for one in served), found


@pytest.mark.thorough
def test_a_creator_fits_a_small_computer() -> None:
    with mission_up() as mission:
        resident = psutil.Process(mission.component("creator-base")["pid"]).memory_info().rss
    assert resident / 2**20 < CREATOR_MIB


def test_the_core_is_imported_in_little_processor_time() -> None:
    code = f"import time; import {CORE}; print(time.process_time())"
    words = [sys.executable, "-c", code]
    took_s = min(float(subprocess.run(words, capture_output=True, check=True).stdout) for _ in range(3))
    assert took_s < CORE_S


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_mission_does_not_grow_among_those_who_send_nonsense() -> None:
    with mission_up() as mission:
        addresses = [f"{c['subsystem']}/{c['name']}" for c in mission.status()["components"] if "cli-" not in c["name"]]
        with zenoh.open(client_config(mission.endpoint)) as session:
            bother(session, mission, addresses, WARM_UP_S)
            before = footprint(mission)
            sent = bother(session, mission, addresses, HOSTILE_S)
        after = footprint(mission)
        print(f"{sent} messages in {HOSTILE_S:.0f} s", *table(before, after), sep="\n")
        restarted = {name for name in before.keys() & after.keys() if before[name].pid != after[name].pid}
        assert not restarted, mission.story()
        assert all(one.log_kb < LOG_KB for one in after.values()), after
        assert not grown(before, after)


def bother(session: zenoh.Session, mission: RunningMission, addresses: list[str], seconds: float) -> int:
    """Send nonsense to every conversation of these addresses for so long; return how many messages."""
    until_s, sent = time.monotonic() + seconds, 0
    for address, payload in itertools.cycle(_nonsense(addresses)):
        if time.monotonic() > until_s:
            return sent
        session.get(key(mission.name, address, Conversation.ASK), lambda _reply: None, payload=payload, timeout=2.0)
        for conversation in Conversation:
            if conversation is not Conversation.ASK:
                session.put(key(mission.name, address, conversation), payload)
        sent += len(Conversation)
        time.sleep(0.002)
    raise AssertionError("nobody to send to")


def _nonsense(addresses: list[str]) -> Iterator[tuple[str, bytes]]:
    for hostile in hostile_messages():
        if len(hostile.payload) < FEW_BYTES:
            for address in addresses:
                yield address, hostile.payload


def table(before: dict[str, Footprint], after: dict[str, Footprint]) -> Iterator[str]:
    """Yield a line for each process that was there before and after."""
    for name in sorted(before.keys() & after.keys()):
        old, new = before[name], after[name]
        yield (
            f"{name:24s} memory {old.memory_kb:7d} -> {new.memory_kb:7d} kB   descriptors {old.descriptors:3d} -> "
            f"{new.descriptors:3d}   threads {old.threads:2d} -> {new.threads:2d}   "
            f"log {old.log_kb:5d} -> {new.log_kb:5d} kB"
        )
