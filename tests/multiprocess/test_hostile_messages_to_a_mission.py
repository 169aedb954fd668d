"""Malformed, oversized and wrong-version messages, and numbers beyond their ranges, to all components of a mission."""

from __future__ import annotations

import asyncio
import json
import time
from pathlib import Path
from typing import Any

import msgspec
import pytest
import trace_judge
import zenoh
from hostile_messages import NeverDefined, enveloped, honest, hostile_messages
from message_catalogue import A_MEGABYTE, catalogue, hostile_bodies
from running_mission import RunningMission, mission_up

from backbone.bus.zenoh_bus import client_config
from backbone.keys import Conversation, key
from backbone.rc_manager.messages import Connect, Disconnect
from backbone.scheduling.requests import RcUse
from backbone.wire import WIRE_VERSION, MalformedMessage, OversizedMessage, Reader, Refused, schema_of
from resource_pool.messages import ImpossibleUse

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

# Chosen: an RC manager that shares two processors with the askers and three more missions waited up to 71 ms for a
# processor, without a message of theirs to read. In which order it decides is judged, not whether it had a processor.
LATE_S = 0.25


def raw_ask(session: zenoh.Session, at: str, payload: bytes) -> bytes:
    """Ask with these bytes and return the bytes of the one answer."""
    answers = list(session.get(at, payload=payload, timeout=5.0))
    assert len(answers) == 1, f"{len(answers)} answers from {at}"
    answer = answers[0]
    return (answer.err.payload if answer.err is not None else answer.ok.payload).to_bytes()


@pytest.mark.thorough
async def test_every_queryable_refuses_hostile_messages_and_nothing_changes() -> None:
    with mission_up() as mission:
        before = mission.status()
        addresses = [f"{c['subsystem']}/{c['name']}" for c in before["components"] if not c["name"].startswith("cli-")]
        with zenoh.open(client_config(mission.endpoint)) as session:
            for address in addresses:
                at = key(mission.name, address, Conversation.ASK)
                for hostile in hostile_messages():
                    raw = await asyncio.to_thread(raw_ask, session, at, hostile.payload)
                    refused = Reader(Refused).read(raw).body
                    assert refused.code == hostile.refusal.code, f"{address} to {hostile.name}: {refused}"
                    assert refused.remedy
        after = mission.status()
        pids = {c["name"]: c["pid"] for c in before["components"] if not c["name"].startswith("cli-")}
        assert {c["name"]: c["pid"] for c in after["components"] if c["name"] in pids} == pids, mission.story()
        assert not any(c["restarts"] for c in after["components"])


@pytest.mark.thorough
async def test_numbers_beyond_their_ranges_change_nothing_in_a_running_mission(tmp_path: Path) -> None:
    """Each field of each message that a component answers, beyond its limits; then the same as publications."""
    trace = tmp_path / "trace.jsonl"
    with mission_up("--trace", str(trace)) as mission:
        before = mission.status()
        addresses = [f"{c['subsystem']}/{c['name']}" for c in before["components"] if not c["name"].startswith("cli-")]
        rcs = [rc["rc"] for rc in before["rcs"]]
        with zenoh.open(client_config(mission.endpoint)) as session:
            for address in addresses:
                await asyncio.to_thread(ask_beyond_ranges, session, mission, address)
            for rc in rcs:
                await asyncio.to_thread(order_what_cannot_be, session, mission, rc)
            await asyncio.to_thread(publish_beyond_ranges, session, mission, addresses)
        assert wait_for_grant(trace, mission.clock.now_s(), 20.0), f"no grant after it\n{mission.story()}"
        after = mission.status()
        pids = {c["name"]: c["pid"] for c in before["components"] if not c["name"].startswith("cli-")}
        assert {c["name"]: c["pid"] for c in after["components"] if c["name"] in pids} == pids, mission.story()
        assert not any(c["restarts"] for c in after["components"])
        assert {rc["rc"]: rc["state"] for rc in after["rcs"]} == dict.fromkeys(rcs, "up")
        assert_trace_says(trace, rcs)
    assert trace_judge.judge().FullChecker(tol=LATE_S).run(lines_of(trace)) == []


def ask_beyond_ranges(session: zenoh.Session, mission: RunningMission, address: str) -> None:
    """Ask a component all that it answers, with one field beyond its range at a time: each is refused by type."""
    at = key(mission.name, address, Conversation.ASK)
    unknown = Reader(Refused).read(raw_ask(session, at, honest(NeverDefined()))).body
    accepted = str(unknown.facts["accepted"]).split(", ")
    for kind in catalogue():
        if schema_of(kind) not in accepted:
            continue
        for sample in hostile_bodies(kind):
            refused = Reader(Refused).read(raw_ask(session, at, enveloped(sample.body))).body
            what = f"{address} to {kind.__name__}, {sample.name}: {refused}"[:1000]
            assert refused.code in (MalformedMessage.code, OversizedMessage.code), what


def order_what_cannot_be(session: zenoh.Session, mission: RunningMission, rc: str) -> None:
    """Order an RC in the name of the RC manager what that cannot have ordered."""
    at = key(mission.name, f"resource_pool/{rc}", Conversation.ASK)
    for epoch, code in ((2**64 - 1, MalformedMessage.code), (2**53, ImpossibleUse.code), (10**9, ImpossibleUse.code)):
        for order in (Disconnect("one", epoch), Connect("one", epoch, 2.0, RcUse(), {})):
            assert refused_code(session, at, order) == code
    assert refused_code(session, at, Connect("one", 5000, 1e9, RcUse(), {})) == MalformedMessage.code


def refused_code(session: zenoh.Session, at: str, order: Any) -> str:
    raw = msgspec.msgpack.encode([WIRE_VERSION, "backbone/rc_manager", 1, 0.5, "", order])
    return Reader(Refused).read(raw_ask(session, at, raw)).body.code


def publish_beyond_ranges(session: zenoh.Session, mission: RunningMission, addresses: list[str]) -> None:
    """Publish all hostile messages of less than 1 MB in the name of each component, in each conversation."""
    payloads = [
        enveloped(sample.body)
        for kind in catalogue()
        for sample in hostile_bodies(kind)
        if "never" in sample.name or "below" in sample.name or "above" in sample.name
    ]
    assert all(len(payload) < A_MEGABYTE for payload in payloads)
    talks = [c for c in Conversation if c not in (Conversation.ASK, Conversation.ALIVE)]
    for number, payload in enumerate(payloads):
        for address in addresses:
            session.put(key(mission.name, address, talks[number % len(talks)]), payload)


def wait_for_grant(trace: Path, from_s: float, within_s: float) -> bool:
    """Return whether an ARC was granted its RCs after this mission time, after a wait of so many seconds at most."""
    deadline = time.monotonic() + within_s
    while time.monotonic() < deadline:
        if any(line["ev"] == "grant" and line["t"] > from_s for line in lines_of(trace)):
            return True
        time.sleep(0.2)
    return False


def assert_trace_says(trace: Path, rcs: list[str]) -> None:
    """Assert that by the trace each RC is up."""
    states: dict[str, str] = {}
    for line in lines_of(trace):
        if line["ev"] in ("rc", "rc_state"):
            states[line["id"]] = line.get("state", "up")
    assert states == dict.fromkeys(rcs, "up")


def lines_of(trace: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in trace.read_text().rpartition("\n")[0].splitlines()]
