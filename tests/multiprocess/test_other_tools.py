"""Foxglove reads a real mission from beside it, and who looks at one ends with it."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from free_ports import free_port
from running_mission import BIN, RunningMission, mission_up
from tool_at_a_port import tool_at
from websockets.asyncio.client import connect
from websockets.typing import Subprotocol

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

CAMERA = "/robots/scout1/camera"
SEEN_WITHIN_S = 120.0  # on a full machine: who looks at a mission goes behind all others
ENDED_WITHIN_S = 30.0


@pytest.fixture(scope="module")
def mission() -> Iterator[RunningMission]:
    with mission_up() as running:
        yield running


@pytest.mark.thorough
async def test_foxglove_sees_the_cameras_of_a_mission(mission: RunningMission) -> None:
    port = free_port()
    with tool_at(mission, "bridge", port):
        protocol = [Subprotocol("foxglove.sdk.v1")]
        async with connect(f"ws://127.0.0.1:{port}", subprotocols=protocol, max_size=None) as link:
            topics, wanted = set[str](), dict[str, object]()
            until_s = time.monotonic() + SEEN_WITHIN_S
            async for got in link:
                assert time.monotonic() < until_s, topics
                if isinstance(got, bytes):
                    assert len(got) > 320 * 240
                    break
                for channel in json.loads(got).get("channels", []):
                    topics.add(channel["topic"])
                    if channel["topic"] == CAMERA:
                        assert channel["schemaName"] == "foxglove.RawImage"
                        wanted = {"op": "subscribe", "subscriptions": [{"id": 1, "channelId": channel["id"]}]}
                if wanted:  # again with each word: the SDK (0.30.3) advertises a channel before it knows it
                    await link.send(json.dumps(wanted))


@pytest.mark.parametrize(
    ("command", "library", "extra"), [("bridge", "foxglove", "foxglove"), ("metrics", "prometheus_client", "metrics")]
)
def test_without_its_library_a_command_tells_what_to_install(command: str, library: str, extra: str) -> None:
    code = f"import sys; sys.modules['{library}'] = None\nfrom backbone.command_line.cli import app; app(['{command}'])"
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True, timeout=60)
    assert (done.returncode, f"scout-backbone[{extra}]" in done.stderr) == (2, True), done.stderr


@pytest.mark.thorough
def test_who_looks_at_a_mission_ends_with_it_and_says_so(tmp_path: Path) -> None:
    ports = [["bridge", "--port", str(free_port())], ["metrics", "--port", str(free_port())]]
    with mission_up() as running, ExitStack() as stack:
        lookers = []
        for number, words in enumerate([*ports, ["watch", "*/world/bodies"], ["watch", "--rate"]]):
            said = tmp_path / f"said-{number}"
            command = [str(BIN / "scout-backbone"), *words, "--mission", running.name]
            output = stack.enter_context(said.open("wb"))
            looker = subprocess.Popen(command, env=running.environment, stdout=output, stderr=subprocess.STDOUT)
            stack.callback(looker.wait, 10)
            stack.callback(looker.kill)
            lookers.append((looker, said))
        until_s = time.monotonic() + SEEN_WITHIN_S
        while not all(said.stat().st_size for _looker, said in lookers):
            assert time.monotonic() < until_s, lookers
            time.sleep(0.2)
        assert running.down() == 0
        for looker, said in lookers:
            assert looker.wait(ENDED_WITHIN_S) == 0, said.read_text()
            assert f"{running.name} has ended" in said.read_text()
