"""Foxglove and Prometheus read a real mission from beside it."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from free_ports import free_port
from prometheus_client.parser import text_string_to_metric_families
from running_mission import BIN, RunningMission, mission_up
from websockets.asyncio.client import connect
from websockets.typing import Subprotocol

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

CAMERA = "/robots/scout1/camera"
SEEN_WITHIN_S = 30.0
ENDED_WITHIN_S = 30.0


@pytest.fixture(scope="module")
def mission() -> Iterator[RunningMission]:
    with mission_up() as running:
        yield running


@contextmanager
def serving(mission: RunningMission, command: str, port: int) -> Iterator[None]:
    """Run a command that serves at a port; it listens when this is entered, and has ended well afterwards."""
    words = [str(BIN / "scout-backbone"), command, "--port", str(port), "--mission", mission.name]
    server = subprocess.Popen(words, env=mission.environment, stderr=subprocess.PIPE, text=True)
    assert server.stderr is not None
    try:
        said = server.stderr.readline()
        assert f"127.0.0.1:{port}" in said, said + server.stderr.read()
        yield
        server.send_signal(signal.SIGINT)
        _none, rest = server.communicate(timeout=20)
        assert server.returncode == 0, rest
    finally:
        server.kill()
        server.wait(10)
        server.stderr.close()


@pytest.mark.thorough
async def test_foxglove_sees_the_cameras_of_a_mission(mission: RunningMission) -> None:
    port = free_port()
    with serving(mission, "bridge", port):
        protocol = [Subprotocol("foxglove.sdk.v1")]
        async with connect(f"ws://127.0.0.1:{port}", subprotocols=protocol, max_size=None) as link:
            topics: set[str] = set()
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
                        wanted = [{"id": 1, "channelId": channel["id"]}]
                        await link.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))


def counters(port: int) -> dict[tuple[str, ...], float]:
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=10) as page:
        families = text_string_to_metric_families(page.read().decode())
        counted = [sample for family in families if family.type == "counter" for sample in family.samples]
    return {(one.name, *(value for _name, value in sorted(one.labels.items()))): one.value for one in counted}


def held_s(found: dict[tuple[str, ...], float], rc: str) -> float:
    """Return for how long the RC was held."""
    return sum(value for (name, *of), value in found.items() if name == "scout_rc_held_seconds_total" and rc in of)


def test_prometheus_reads_who_held_what_and_no_counter_falls(mission: RunningMission) -> None:
    port = free_port()
    with serving(mission, "metrics", port):
        before, until_s = counters(port), time.monotonic() + SEEN_WITHIN_S
        while not (held_s(before, "video1") and any(name == "scout_rc_grants_total" for name, *_ in before)):
            assert time.monotonic() < until_s, before
            time.sleep(0.2)
            after = counters(port)
            assert all(after[name] >= value for name, value in before.items())
            before = after
    assert held_s(before, "video1") <= before["scout_watched_seconds_total",]


@pytest.mark.parametrize(
    ("command", "library", "extra"), [("bridge", "foxglove", "foxglove"), ("metrics", "prometheus_client", "metrics")]
)
def test_without_its_library_a_command_tells_what_to_install(command: str, library: str, extra: str) -> None:
    code = f"import sys; sys.modules['{library}'] = None\nfrom backbone.command_line.cli import app; app(['{command}'])"
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True, timeout=60)
    assert (done.returncode, f"scout-backbone[{extra}]" in done.stderr) == (2, True), done.stderr


def test_a_port_that_is_taken_is_refused(mission: RunningMission) -> None:
    port = free_port()
    with serving(mission, "metrics", port):
        for command in ("bridge", "metrics"):
            done = mission.command("scout-backbone", command, "--port", str(port), "--mission", mission.name)
            assert (done.returncode, "--port" in done.stderr) == (2, True), done.stderr


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
