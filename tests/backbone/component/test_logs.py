"""Logs stay small under any output of any process, and on a full disk no component ends because of them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from backbone.component.logs import ENDED_KEPT, FOLDER_BYTES, LINE_BYTES, LOG_BYTES, log_path, open_log, tidy

BEGIN = """
import asyncio, ctypes, logging, os, sys
from backbone.component.logs import ComponentLog, redirect
redirect(sys.argv[1], "scout1")
kept = ComponentLog("scout1", sys.argv[1])
kept.install()
log = logging.getLogger("tests")
"""


def run(folder: Path, program: str) -> int:
    done = subprocess.run([sys.executable, "-c", BEGIN + program, str(folder)], check=False, timeout=60)
    return done.returncode


def log_folder(folder: Path) -> Path:
    (folder / "log").mkdir()
    return folder / "log"


def sizes(logs: Path) -> dict[str, int]:
    return {path.name: path.stat().st_size for path in logs.glob("scout1.*")}


@pytest.mark.processes
def test_a_log_that_grows_is_kept_in_two_small_files(tmp_path: Path) -> None:
    logs = log_folder(tmp_path)
    talk = "".join(f"log.info('%d' + 'x' * 1000, number)  # {place}\n    " for place in range(10))
    assert run(tmp_path, f"for number in range(1000):\n    {talk}\n    kept._repeats.rest()\nlog.info('the end')") == 0
    found = sizes(logs)
    assert set(found) == {"scout1.log", "scout1.log.1"}
    assert max(found.values()) < LOG_BYTES * 1.2
    assert "the end" in (logs / "scout1.log").read_text()


@pytest.mark.processes
def test_what_c_libraries_say_is_kept_small_too_and_goes_to_the_new_file(tmp_path: Path) -> None:
    logs = log_folder(tmp_path)
    program = f"os.write(2, b'x' * {LOG_BYTES + 1})\nkept.look_after()\nos.write(1, b'out')\nos.write(2, b'err')"
    assert run(tmp_path, program) == 0
    assert sizes(logs) == {"scout1.log": 6, "scout1.log.1": LOG_BYTES + 1}


@pytest.mark.processes
def test_the_loop_looks_after_the_file_when_nothing_is_logged(tmp_path: Path) -> None:
    logs = log_folder(tmp_path)
    program = f"""
from backbone.bus.clock import VirtualLoop
async def main():
    kept.watch(asyncio.get_running_loop())
    os.write(2, b"x" * {LOG_BYTES + 1})
    await asyncio.sleep(6)
with asyncio.Runner(loop_factory=VirtualLoop) as runner:
    runner.run(main())
"""
    assert run(tmp_path, program) == 0
    assert sizes(logs) == {"scout1.log": 0, "scout1.log.1": LOG_BYTES + 1}


@pytest.mark.processes
def test_a_process_follows_when_another_life_of_its_name_began_a_new_file(tmp_path: Path) -> None:
    logs = log_folder(tmp_path)
    other = f"os.replace('{logs}/scout1.log', '{logs}/scout1.log.1'); open('{logs}/scout1.log', 'w').close()"
    program = f"os.write(2, b'x' * {LOG_BYTES + 1})\n{other}\nkept.look_after()\nos.write(2, b'here')"
    assert run(tmp_path, program) == 0
    assert sizes(logs) == {"scout1.log": 4, "scout1.log.1": LOG_BYTES + 1}


@pytest.mark.processes
def test_a_file_of_the_component_at_descriptor_2_gets_no_line_of_the_log(tmp_path: Path) -> None:
    """As after a constructor that closed the descriptor: its cause would be lost, and its file spoiled."""
    logs = log_folder(tmp_path)
    program = f"""
os.close(2)
own = open('{tmp_path}/own', 'wb', buffering=0)
assert own.fileno() == 2
log.error('the cause')
os.write(1, b"x" * {LOG_BYTES + 1})
kept.look_after()
log.error('in the new file')
own.write(b'own')
"""
    assert run(tmp_path, program) == 0
    assert (tmp_path / "own").read_bytes() == b"own"
    assert "the cause" in (logs / "scout1.log.1").read_text()
    assert "in the new file" in (logs / "scout1.log").read_text()


@pytest.mark.processes
def test_a_full_disk_ends_nothing(tmp_path: Path) -> None:
    log_folder(tmp_path)
    program = (
        "full = os.open('/dev/full', os.O_WRONLY); os.dup2(full, 1); os.dup2(full, 2)\n"
        "for number in range(100): log.error('%d', number, exc_info=ValueError())\n"
        "kept.look_after(); kept.close()\nos._exit(7)"
    )
    assert run(tmp_path, program) == 7


@pytest.mark.processes
def test_without_a_folder_output_goes_nowhere_and_brings_no_folder_back(tmp_path: Path) -> None:
    assert run(tmp_path / "ended", "log.error('x'); kept.look_after()") == 0
    assert list(tmp_path.iterdir()) == []


@pytest.mark.processes
def test_lines_of_strangers_are_cut_and_move_no_cursor(tmp_path: Path) -> None:
    logs = log_folder(tmp_path)
    assert run(tmp_path, "log.warning('\\x1b[2J\\x9b\\r\\ud800'); log.warning('x' * 1_000_000)") == 0
    text = (logs / "scout1.log").read_text()
    assert r"\x1b[2J\x9b\r\ud800" in text
    assert len(text) < LINE_BYTES + 300


@pytest.mark.processes
def test_a_process_that_replaced_its_streams_by_none_logs_on(tmp_path: Path) -> None:
    logs = log_folder(tmp_path)
    assert run(tmp_path, "sys.stdout = sys.stderr = None; log.error('still here'); kept.look_after()") == 0
    assert "still here" in (logs / "scout1.log").read_text()


@pytest.mark.processes
def test_the_time_of_what_was_counted_is_told(tmp_path: Path) -> None:
    logs = log_folder(tmp_path)
    assert run(tmp_path, "for _ in range(513): log.warning('late')\nkept.close()") == 0
    first, last = (logs / "scout1.log").read_text().splitlines()
    assert first.endswith("WARNING scout1 tests: late")
    assert last.endswith("repeated 512 times within 10 s, the last time as: late")


def test_of_the_dead_the_newest_stay_and_of_the_living_all(tmp_path: Path) -> None:
    logs = log_folder(tmp_path)
    held = open_log(str(tmp_path), "console-0")
    for number in range(ENDED_KEPT + 10):
        for ending in ("log", "log.1"):
            path = logs / f"console-{number}.{ending}"
            path.touch()
            os.utime(path, (1000 + number, 1000 + number))
    try:
        tidy(logs, now_s=5000.0)
        left = {path.name for path in logs.glob("*.log")}
        assert left == {"console-0.log"} | {f"console-{number}.log" for number in range(10, ENDED_KEPT + 10)}
        assert {path.name[:-2] for path in logs.glob("*.log.1")} == left
    finally:
        os.close(held)


def test_logs_that_are_too_big_together_lose_the_oldest_of_the_dead(tmp_path: Path) -> None:
    logs = log_folder(tmp_path)
    held = open_log(str(tmp_path), "scout0")
    for number in range(5):
        path = logs / f"scout{number}.log"
        with path.open("wb") as file:
            file.truncate(FOLDER_BYTES // 4)
        os.utime(path, (1000 + number, 1000 + number))
    try:
        tidy(logs, now_s=5000.0)
        assert {path.name for path in logs.glob("*.log")} == {"scout0.log", "scout2.log", "scout3.log", "scout4.log"}
    finally:
        os.close(held)


def test_a_folder_is_looked_through_once_in_a_while(tmp_path: Path) -> None:
    logs = log_folder(tmp_path)
    tidy(logs, now_s=5000.0)
    for number in range(ENDED_KEPT + 1):
        log_path(str(tmp_path), f"console-{number}").touch()
    tidy(logs, now_s=5009.0)
    assert len(list(logs.glob("*.log"))) == ENDED_KEPT + 1
    tidy(logs, now_s=5010.0)
    assert len(list(logs.glob("*.log"))) == ENDED_KEPT
