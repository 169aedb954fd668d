"""Another account of the machine, with bare zenoh: nothing that it tries changes anything."""

from __future__ import annotations

import asyncio
import json
import os
import pwd
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil
import pytest
from examples import rest_thorough
from running_mission import MARK, RunningMission, mission_up
from three_hosts import NAME, mission_on_three_hosts

from backbone.bus.interface import Bus
from backbone.operating_system.memory_folder import temporary_folder
from resource_pool.stop_messages import AskStop, EmergencyStop, StopState

pytestmark = [
    pytest.mark.processes,
    pytest.mark.timeout(300),
    pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another account"),
]

ATTEMPTS = 1000
FEW_ATTEMPTS = 280  # each attack twenty times: together they meet every way in
ATTACKER = Path(__file__).with_name("attacker.py")
BUS_ATTACKS = 8


@pytest.fixture(scope="module")
def mission() -> Iterator[RunningMission]:
    """Give a mission on one machine; the last of its tests ends it."""
    with mission_up() as running:
        yield running


@pytest.fixture
def victim() -> Iterator[Path]:
    """Give a file of ours that others may read."""
    with tempfile.TemporaryDirectory(prefix="scout-victim-") as folder:
        Path(folder).chmod(0o755)
        file = Path(folder) / "victim"
        file.write_text("ours\n")
        yield file
        assert file.read_text() == "ours\n"
        assert [path.name for path in Path(folder).iterdir()] == ["victim"]


def ports_of(processes: list[psutil.Process]) -> list[int]:
    """Return the TCP ports at which these processes listen."""
    found = {c.laddr.port for p in processes for c in p.net_connections("tcp") if c.status == psutil.CONN_LISTEN}
    return sorted(found)


def lines_of(processes: list[psutil.Process]) -> list[str]:
    """Return the names at which these processes take questions of their host; other missions have such names too."""
    names = set()
    for process in processes:
        of_process = Path(f"/proc/{process.pid}")
        own = set()
        for descriptor in (of_process / "fd").iterdir():
            with suppress(FileNotFoundError):  # closed meanwhile
                own.add(os.readlink(descriptor))
        for row in (of_process / "net" / "unix").read_text().splitlines():  # of the process's network namespace
            *_, inode, name = row.split()
            if f"socket:[{inode}]" in own and name.startswith("@scout-backbone/"):
                names.add(name)
    return sorted(names)


def let_others_enter(folder: Path) -> None:
    """Open all folders around the missions' own, which alone then keeps others out."""
    tops = {Path(tempfile.gettempdir()), temporary_folder()}
    for parent in (folder, *folder.parents):
        if tops.intersection(parent.parents):
            parent.chmod(0o755)


def attacks(given: dict[str, Any], before: tuple[str, ...] = ()) -> dict[str, Any]:
    """Run the attacker in a process of its own and return what it reached."""
    done = subprocess.run(
        [*before, sys.executable, str(ATTACKER)], input=json.dumps(given), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


async def stop_scout3(bus: Bus) -> StopState:
    order = EmergencyStop("a person is in the room", "safety")
    return await bus.ask("resource_pool/scout3", order, StopState, within_s=5.0)


def lives(status: dict[str, Any]) -> dict[str, tuple[int, int]]:
    """Return process and restarts of everything but visitors and ARCs, which come a moment after all is ready."""
    lasting = [c for c in status["components"] if c["subsystem"] != "ui_console" and c["type"] != "capture"]
    return {c["name"]: (c["pid"], c["restarts"]) for c in lasting}


def what_is_known(mission: RunningMission, uid: int, victim: Path) -> dict[str, Any]:
    """Return all that an account of the machine could know of the mission."""
    processes = mission.processes()
    return {
        "uid": uid,
        "mission": mission.name,
        "creator": "backbone/creator-base",
        "endpoints": [mission.endpoint, *(f"tcp/127.0.0.1:{port}" for port in {*ports_of(processes), 7447})],
        "folder": str(mission.directory),
        "victim": str(victim),
        "pids": [process.pid for process in processes],
        "lines": lines_of(processes),
    }


@pytest.mark.parametrize("attempts", rest_thorough([FEW_ATTEMPTS, ATTEMPTS]))
async def test_no_attack_from_another_account_changes_a_mission_on_one_machine(
    mission: RunningMission, victim: Path, attempts: int
) -> None:
    let_others_enter(Path(mission.environment["XDG_RUNTIME_DIR"]))
    async with mission.bus() as bus:
        stopped = await stop_scout3(bus)
        mission.wait_for_components("watch-scout1", "watch-scout2")
        before = lives(mission.status())
        given = {**what_is_known(mission, pwd.getpwnam("nobody").pw_uid, victim), "attempts": attempts}
        found = await asyncio.to_thread(attacks, given)
        assert sum(found["tried"].values()) == attempts
        assert found["reached"] == {}, found
        assert await bus.ask("resource_pool/scout3", AskStop(), StopState, within_s=5.0) == stopped
    assert lives(mission.status()) == before, mission.story()
    assert ports_of(mission.processes()) == [], "a mission on one machine opens no port"


async def test_the_missions_own_account_starts_no_class_and_opens_no_file_through_a_creator(
    mission: RunningMission, victim: Path
) -> None:
    """The attacks are real: from the mission's own account those that a user may do succeed, and only those."""
    async with mission.bus() as bus:
        await stop_scout3(bus)
    given = {**what_is_known(mission, 0, victim), "endpoints": [mission.endpoint], "attempts": BUS_ATTACKS}
    answers = (await asyncio.to_thread(attacks, given))["answers"]
    assert len(answers) == BUS_ATTACKS
    assert "creator.unlisted_type" in answers["spawn_any_class"]
    assert "creator.unlisted_type" in answers["append_trace_lines"]
    assert "wire.malformed" in answers["log_elsewhere"], "no such name passes the decoding"
    assert "creator.fixed_types" in answers["allow_any_type"]
    assert "Refused" in answers["redirect_the_trace"]
    assert "StopState" in answers["lift_a_stop"]
    assert "Stopping" in answers["stop_the_launcher"]
    assert mission.launcher.wait(30) == 0, mission.story()


@pytest.mark.thorough
def test_no_attack_without_the_secret_changes_a_mission_on_three_machines(victim: Path, short_path: Path) -> None:
    with mission_on_three_hosts(short_path) as mission:
        base = mission.hosts["base"]
        assert base.listens_at() == [f"{base.address}:7447"]
        folder = base.runtime_folder / "scout-backbone" / NAME
        let_others_enter(base.runtime_folder)
        before = {name: c.pid for name, c in mission.components().items() if name in mission.names}
        given = {
            "uid": pwd.getpwnam("nobody").pw_uid,
            "mission": NAME,
            "creator": "backbone/creator-far",
            "endpoints": [f"unixsock-stream/{folder}/hub.sock", f"tcp/{base.address}:7447"],
            "folder": str(folder),
            "victim": str(victim),
            "pids": [process.pid for process in base.processes()],
            "attempts": ATTEMPTS // 2,
        }
        for host in (base, mission.hosts["far"]):
            found = attacks(given | {"lines": lines_of(host.processes())}, ("ip", "netns", "exec", host.namespace))
            assert sum(found["tried"].values()) == ATTEMPTS // 2
            assert found["reached"] == {}, found
        after = {name: c.pid for name, c in mission.components().items() if name in mission.names}
        assert after == before, mission.story()
        assert {process.environ().get(MARK) for process in base.processes()} == {mission.environment[MARK]}
