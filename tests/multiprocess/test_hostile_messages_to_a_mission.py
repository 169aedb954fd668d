"""Malformed, truncated, oversized and wrong-version messages to every queryable of a running mission."""

from __future__ import annotations

import asyncio

import pytest
import zenoh
from hostile_messages import hostile_messages
from running_mission import mission_up

from backbone.bus.zenoh_bus import client_config
from backbone.keys import Conversation, key
from backbone.wire import Reader, Refused

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]


def raw_ask(session: zenoh.Session, at: str, payload: bytes) -> bytes:
    """Ask with these bytes and return the bytes of the one answer."""
    answers = list(session.get(at, payload=payload, timeout=5.0))
    assert len(answers) == 1, f"{len(answers)} answers from {at}"
    answer = answers[0]
    return (answer.err.payload if answer.err is not None else answer.ok.payload).to_bytes()


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
