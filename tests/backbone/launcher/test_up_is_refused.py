"""What ``up`` refuses before it starts anything: nothing of the mission is left then."""

from __future__ import annotations

import asyncio
import os
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import msgspec
import pytest
from typer.testing import CliRunner

from backbone import run_files
from backbone.authentication import SocketPathTooLong
from backbone.bus.interface import Bus, Clock
from backbone.command_line.cli import app
from backbone.errors import Refusal
from backbone.launcher.bring_up import run_mission
from backbone.launcher.core_launches import UpOptions
from backbone.launcher.preconditions import PathNotUtf8, PortTaken
from backbone.mission.model import Host, MissionDescription
from backbone.mission.reader import read_mission
from backbone.run_files import TraceUnwritable

MISSION_XML = Path(__file__).parents[3] / "mission.xml"
FAR = Host(name="far", address="192.0.2.7")


class Nobody:
    """Watches a mission that must not begin."""

    def comes_up(self, mission: str) -> None:
        raise AssertionError(f"{mission} comes up")

    def began(self, step: str) -> None:
        raise AssertionError(f"{step} began")

    def done(self, step: str, took_s: float) -> None: ...

    def announce(self, line: str) -> None: ...

    def connected(self, bus: Bus) -> None: ...

    async def up(self, bus: Bus, clock: Clock) -> None: ...


@pytest.fixture(autouse=True)
def runtime_directory(short_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(short_path))
    return short_path


@pytest.fixture(scope="module")
def shipped() -> MissionDescription:
    return read_mission(MISSION_XML)


def refused(kind: type[Refusal], description: MissionDescription, options: UpOptions, folder: Path) -> str:
    with pytest.raises(kind) as caught:
        asyncio.run(run_mission(description, options, Nobody()))
    missions = folder / "scout-backbone"
    assert not missions.exists() or os.listdir(missions) == []
    return str(caught.value)


def test_a_trace_that_cannot_be_written(shipped: MissionDescription, tmp_path: Path, short_path: Path) -> None:
    for bad in (tmp_path / "no folder" / "trace.jsonl", tmp_path):
        assert str(bad) in refused(TraceUnwritable, shipped, UpOptions(trace=bad), short_path)


def test_a_path_that_no_message_can_contain(
    shipped: MissionDescription, tmp_path: Path, short_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    strange = tmp_path / os.fsdecode(b"r\xfcbe")
    elsewhere = msgspec.structs.replace(shipped, source=str(strange / "mission.xml"))
    for description, options in (
        (elsewhere, UpOptions()),
        (shipped, UpOptions(trace=strange)),
        (shipped, UpOptions(record=strange)),
    ):
        told = refused(PathNotUtf8, description, options, short_path)
        assert r"r\udcfcbe" in told
        told.encode()
    assert not strange.exists()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(strange))
    refused(PathNotUtf8, shipped, UpOptions(), strange)


def test_a_mission_that_another_command_is_bringing_up_is_left_alone(
    shipped: MissionDescription, tmp_path: Path
) -> None:
    with run_files.own_folder(shipped.name):
        socket_of_the_other = run_files.run_directory(shipped.name) / "hub.sock"
        socket_of_the_other.touch()
        trace = tmp_path / "trace.jsonl"
        with pytest.raises(run_files.FolderInUse):
            asyncio.run(run_mission(shipped, UpOptions(trace=trace), Nobody()))
        assert socket_of_the_other.exists()
        assert not trace.exists()


def test_the_command_ends_with_4_and_names_the_trace_once(tmp_path: Path) -> None:
    bad = tmp_path / "no folder" / "trace.jsonl"
    done = CliRunner().invoke(app, ["up", str(MISSION_XML), "--headless", "--trace", str(bad)])
    assert done.exit_code == 4
    assert "run.trace" in done.output
    assert done.output.count(str(bad)) == 1
    assert "comes up" not in done.output, "it was refused before"


def test_a_port_that_is_taken_or_an_address_that_is_anothers(shipped: MissionDescription, short_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        base = Host(name="base", address="127.0.0.1", port=taken.getsockname()[1])
        description = msgspec.structs.replace(shipped, hosts=(base, FAR))
        assert f"port {base.port}" in refused(PortTaken, description, UpOptions(), short_path)
    elsewhere = msgspec.structs.replace(shipped, hosts=(Host(name="base", address="192.0.2.1"), FAR))
    assert "192.0.2.1" in refused(PortTaken, elsewhere, UpOptions(), short_path)


def test_a_folder_too_deep_for_a_socket(
    shipped: MissionDescription, short_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    deep = short_path / ("d" * 80)
    deep.mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(deep))
    assert "XDG_RUNTIME_DIR" in refused(SocketPathTooLong, shipped, UpOptions(), deep)


@pytest.mark.processes
@pytest.mark.parametrize(
    "command",
    [
        ["up", str(MISSION_XML), "--headless"],
        ["creator", "--host", "far", "--mission", "iros2001", "--connect", "tcp/127.0.0.1:7447"],
    ],
    ids=lambda command: command[0],
)
def test_a_machine_that_shows_no_processes(command: list[str]) -> None:
    hidden = ["unshare", "--map-root-user", "--mount", "sh", "-c", 'mount -t tmpfs none /proc && exec "$@"', "sh"]
    if shutil.which("unshare") is None or subprocess.run([*hidden, "true"], check=False).returncode:
        pytest.skip("this account may have no mounts of its own")
    words = [*hidden, sys.executable, "-P", "-m", "backbone.command_line.cli", *command]
    done = subprocess.run(words, check=False, capture_output=True, text=True, timeout=30)
    assert done.returncode == 4, done.stderr
    assert "refused [run.no_processes]: /proc of this machine cannot be read" in done.stderr
    assert "comes up" not in done.stderr


@pytest.mark.processes
def test_a_system_that_lets_a_process_open_too_few_files() -> None:
    words = ["sh", "-c", 'ulimit -n 200 && exec "$@"', "sh", sys.executable, "-P", "-m", "backbone.command_line.cli"]
    command = ["up", str(MISSION_XML), "--headless"]
    done = subprocess.run([*words, *command], check=False, capture_output=True, text=True, timeout=30)
    assert done.returncode == 4, done.stderr
    assert "refused [run.files]: a process may open 200 files" in done.stderr
    assert "ulimit -n" in done.stderr
    assert "comes up" not in done.stderr
