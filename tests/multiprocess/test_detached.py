"""``up --detach`` ends with the launcher's own verdict, while its process goes on."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
import time
import uuid
from pathlib import Path

import psutil
import pytest
from running_mission import MARK, MISSION_XML, marked, mission_up, wait_gone

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

BIN = Path(sys.executable).parent
SMALLEST = Path(__file__).parents[2] / "docs" / "examples" / "smallest.xml"
GRABBER = """</hosts>
  <types>
    <type name="framegrabber" class="sample_broken_rc:BrokenRc" subsystem="resource_pool" uses="video_frequency"/>
  </types>"""
TIMES = 20


def mission_file(folder: Path, change: dict[str, str]) -> Path:
    text = MISSION_XML.read_text()
    for old, new in change.items():
        assert old in text
        text = text.replace(old, new, 1)
    file = folder / "mission.xml"
    file.write_text(text)
    return file


def environment(folder: Path, mark: str) -> dict[str, str]:
    paths = [str(Path(__file__).parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "XDG_RUNTIME_DIR": str(folder), MARK: mark, "PYTHONPATH": os.pathsep.join(paths)}


def command(folder: Path, mark: str, *words: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(BIN / "scout-backbone"), *words],
        cwd=cwd,
        env=environment(folder, mark),
        capture_output=True,
        text=True,
        timeout=90,
        check=False,
    )


def assert_up_says(exit_code: int, folder: Path, change: dict[str, str]) -> None:
    mark = uuid.uuid4().hex
    up = command(folder, mark, "up", str(mission_file(folder, change)), "--detach")
    try:
        assert up.returncode == exit_code, up.stderr
        assert ("goes on as process" in up.stderr) == (exit_code == 0), up.stderr
    finally:
        if up.returncode == 0:
            down = command(folder, mark, "down")
            assert down.returncode == 0, down.stderr
        left = wait_gone(mark, 10.0)
        for process in left:
            with contextlib.suppress(psutil.Error):
                process.kill()
    assert not left


def test_no_process_of_a_mission_imports_modules_of_the_working_folder(tmp_path: Path) -> None:
    """Another account can put files into a shared folder, and a folder of one's own may have a ``random.py``."""
    shared, mark = tmp_path / "shared", uuid.uuid4().hex
    shared.mkdir()
    for module in ("msgspec", "random"):
        (shared / f"{module}.py").write_text(f"open({str(tmp_path / 'imported')!r}, 'a').write(__name__)\n")
    try:
        up = command(tmp_path, mark, "up", str(SMALLEST), "--detach", "--record", "run.mcap", cwd=shared)
        assert up.returncode == 0, up.stderr
    finally:
        down = command(tmp_path, mark, "down")
        left = wait_gone(mark, 10.0)
        for process in left:
            process.kill()
    assert down.returncode == 0, down.stderr
    assert not left
    assert not (tmp_path / "imported").exists()


FAILS = {"</hosts>": GRABBER, '<parameter name="frame_rate_hz" value="15"/>': ""}
NO_HUB = {'name="iros2001"': f'name="{"m" * 63}"'}  # no socket has so long a path


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("exit_code", "change"), [(0, {}), (6, FAILS), (4, NO_HUB)], ids=["comes up", "fails", "has no hub"]
)
def test_it_ends_with_how_the_mission_came_up(exit_code: int, change: dict[str, str], tmp_path: Path) -> None:
    assert_up_says(exit_code, tmp_path, change)


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize(("exit_code", "change"), [(0, {}), (6, FAILS)], ids=["comes up", "fails"])
def test_it_does_so_twenty_times_in_a_row(exit_code: int, change: dict[str, str], tmp_path: Path) -> None:
    for _ in range(TIMES):
        assert_up_says(exit_code, tmp_path, change)


@pytest.mark.thorough
def test_of_two_that_start_at_once_one_comes_up_and_the_other_is_refused(tmp_path: Path) -> None:
    mark = uuid.uuid4().hex
    words = [str(BIN / "scout-backbone"), "up", str(SMALLEST), "--detach"]
    both = [
        subprocess.Popen(words, env=environment(tmp_path, mark), stderr=subprocess.PIPE, text=True) for _ in range(2)
    ]
    try:
        said = {up.communicate(timeout=90)[1]: up.returncode for up in both}
        assert sorted(said.values()) == [0, 4], said
        down = command(tmp_path, mark, "down")
        assert down.returncode == 0, down.stderr
    finally:
        for process in wait_gone(mark, 10.0):
            with contextlib.suppress(psutil.Error):
                process.kill()


def test_a_launcher_that_is_killed_before_all_is_ready_is_a_failure(tmp_path: Path) -> None:
    mark = uuid.uuid4().hex
    up = subprocess.Popen(
        [str(BIN / "scout-backbone"), "up", str(SMALLEST), "--detach"],
        env=environment(tmp_path, mark),
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        launcher(up, mark).kill()
        _, said = up.communicate(timeout=60)
        assert up.returncode == 6, said
        assert "ended without a verdict: SIGKILL" in said
    finally:
        up.kill()
        up.wait()
        for process in wait_gone(mark, 10.0):
            with contextlib.suppress(psutil.Error):
                process.kill()


def launcher(up: subprocess.Popen[str], mark: str) -> psutil.Process:
    """Return the process that ``up --detach`` started, once its nameserver is there."""
    assert up.stderr is not None
    for line in up.stderr:
        if "nameserver" in line:
            break
    deadline = time.monotonic() + 10.0
    while time.monotonic() < deadline:
        for process in marked(mark):
            if process.ppid() == up.pid:
                return process
    raise AssertionError("no launcher")


def test_a_mission_that_nobody_can_find_any_more_ends() -> None:
    with mission_up(mission_xml=SMALLEST) as mission:
        shutil.rmtree(mission.directory.rename(mission.directory.with_name("removed")))  # services write files there
        assert mission.launcher.wait(20) == 6, mission.story()
        mission.wait_for_line("the mission failed: .*was removed", 15.0)
        assert wait_gone(mission.environment[MARK], 3.0) == []
        assert not mission.directory.exists()
