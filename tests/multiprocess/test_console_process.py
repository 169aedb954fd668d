"""``scout-console attach --script`` as a process of its own, over Zenoh, against an ARC that decides nothing."""

from __future__ import annotations

import asyncio
import json
import os
import pty
import signal
import sys
import termios
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path
from typing import Any

import crashing_console
import pytest
from fake_resource_pool import FakeArc, FakePlacer
from free_ports import free_endpoint

from backbone import run_files
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus, Clock
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.component.launch import Launch
from backbone.nameserver.service import Nameserver
from backbone.naming import Subsystem
from resource_pool.commands import Halt, Move

pytestmark = pytest.mark.processes

MISSION = "console-test"
WITHIN_S = 20.0


class ZenohNetwork:
    """Joins buses through one hub, as ``LocalNetwork`` does inside a process."""

    def __init__(self, endpoint: str) -> None:
        self.mission, self.endpoint = MISSION, endpoint

    def join(self, source: str, clock: Clock) -> Bus:
        return ZenohBus.open(MISSION, source, clock, client_config(self.endpoint))


ATTACH = ("attach", "scout1", "--kind", "capture")  # no database is there to ask for the kind


@asynccontextmanager
async def placer_behind_a_hub(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, beside: Callable[..., Any]
) -> AsyncIterator[FakePlacer]:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    endpoint = free_endpoint()
    clock = MissionClock.started_now()
    launch = Launch(
        MISSION,
        Subsystem.BACKBONE,
        "nameserver",
        "nameserver",
        "in this process",
        "local",
        endpoint,
        clock.origin_monotonic_s,
        1.0,
    )
    hub = ZenohBus.open(MISSION, launch.address, clock, hub_config([endpoint]))
    async with beside(Nameserver(launch, hub, clock)):
        placer = FakePlacer(ZenohNetwork(endpoint), clock, {})  # type: ignore[arg-type]
        run_files.write(
            run_files.RunFile(MISSION, endpoint, os.getpid(), clock.origin_monotonic_s, 1.0, "local", "none")
        )
        try:
            yield placer
        finally:
            await placer.close()
            run_files.remove(MISSION)


async def console(
    *arguments: str, stdin: int = asyncio.subprocess.DEVNULL, stdout: int = asyncio.subprocess.PIPE
) -> asyncio.subprocess.Process:
    return await asyncio.create_subprocess_exec(
        sys.executable,
        "-m",
        "ui_console.cli",
        *ATTACH,
        *arguments,
        stdin=stdin,
        stdout=stdout,
        stderr=asyncio.subprocess.PIPE,
    )


def grant_at_once(placer: FakePlacer) -> Callable[[FakeArc], None]:
    return lambda arc: arc.bus.start(arc.grant())  # type: ignore[attr-defined]


async def test_a_script_is_driven_and_ends_with_zero(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, beside: Callable[..., Any]
) -> None:
    script = tmp_path / "drive.jsonl"
    script.write_text('{"at_s":0.1,"left_rad_s":4,"right_rad_s":4}\n{"at_s":0.6,"release":true}\n')
    async with placer_behind_a_hub(tmp_path, monkeypatch, beside) as placer:
        placer.on_arc = grant_at_once(placer)
        async with asyncio.timeout(WITHIN_S):
            process = await console("--script", str(script), "--priority", "100")
            out, err = await process.communicate()
    lines = [json.loads(line) for line in out.splitlines()]
    words = [line["event"] for line in lines]
    assert process.returncode == 0, err.decode()
    assert (words[0], words[-1]) == ("granted", "released")
    assert set(words[1:-1]) == {"applied"}
    assert lines[0]["at_s"] >= lines[0]["asked_s"]


async def test_lines_on_standard_input_are_carried_out_as_they_come(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, beside: Callable[..., Any]
) -> None:
    async with placer_behind_a_hub(tmp_path, monkeypatch, beside) as placer:
        placer.on_arc = grant_at_once(placer)
        async with asyncio.timeout(WITHIN_S):
            process = await console("--json", stdin=asyncio.subprocess.PIPE)
            assert process.stdin is not None
            assert process.stdout is not None
            assert json.loads(await process.stdout.readline())["event"] == "granted"
            process.stdin.write(b'{"at_s":0,"left_rad_s":2,"right_rad_s":2}\n')
            applied = json.loads(await process.stdout.readline())
            assert (applied["event"], applied["values"]["left_rad_s"]) == ("applied", 2.0)
            process.stdin.write(b'{"at_s":0,"release":true}\n')
            await process.communicate()
    assert process.returncode == 0


async def test_interrupted_it_gives_the_robot_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, beside: Callable[..., Any]
) -> None:
    async with placer_behind_a_hub(tmp_path, monkeypatch, beside) as placer:
        placer.on_arc = grant_at_once(placer)
        async with asyncio.timeout(WITHIN_S):
            process = await console("--json", stdin=asyncio.subprocess.PIPE)
            assert process.stdout is not None
            await process.stdout.readline()
            process.send_signal(signal.SIGINT)
            out, _err = await process.communicate()
        assert json.loads(out.splitlines()[-1])["event"] == "released"
        assert process.returncode == 130
        assert not placer.arcs


async def test_a_reader_that_goes_away_ends_it_in_good_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, beside: Callable[..., Any]
) -> None:
    """As ``scout-console attach … --json | head -1`` does."""
    async with placer_behind_a_hub(tmp_path, monkeypatch, beside) as placer:
        placer.on_arc = grant_at_once(placer)
        ours, theirs = os.pipe()
        async with asyncio.timeout(WITHIN_S):
            process = await console("--json", stdin=asyncio.subprocess.PIPE, stdout=theirs)
            os.close(theirs)
            assert b"granted" in await asyncio.to_thread(os.read, ours, 4096)
            os.close(ours)
            assert process.stdin is not None
            process.stdin.write(b'{"at_s":0,"left_rad_s":2,"right_rad_s":2}\n')
            _out, err = await process.communicate()
        assert (process.returncode, err.decode()) == (0, "")
        assert not placer.arcs


async def test_on_a_terminal_keys_drive_pictures_are_drawn_and_q_gives_the_robot_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, beside: Callable[..., Any]
) -> None:
    monkeypatch.setenv("TERM", "xterm-256color")
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(ours, (40, 132))
    drawn = bytearray()
    loop = asyncio.get_running_loop()
    loop.add_reader(ours, lambda: drawn.extend(os.read(ours, 65536)))
    async with placer_behind_a_hub(tmp_path, monkeypatch, beside) as placer, AsyncExitStack() as leftovers:
        placer.on_arc = grant_at_once(placer)
        async with asyncio.timeout(WITHIN_S):
            process = await asyncio.create_subprocess_exec(
                sys.executable,
                "-m",
                "ui_console.cli",
                *ATTACH,
                stdin=theirs,
                stdout=theirs,
                stderr=theirs,
                start_new_session=True,
            )
            os.close(theirs)
            leftovers.callback(lambda: process.returncode is None and process.kill())
            await placer.wait(lambda: placer.arcs)
            [arc] = placer.arcs.values()
            await placer.wait(lambda: b"scout1" in drawn)

            def a_picture_is_drawn() -> bool:
                arc.publish(bytes(range(240)) * 320, 320, 240)  # again: the first may come before the console listens
                return "▀".encode() in drawn

            await placer.wait(a_picture_is_drawn)
            os.write(ours, b"w")
            await placer.wait(lambda: arc.commands and isinstance(arc.commands[-1][2], Halt))
            os.write(ours, b"q")
            assert await process.wait() == 0
            assert not placer.arcs
    loop.remove_reader(ours)
    os.close(ours)
    assert any(isinstance(command, Move) for _at_s, _epoch, command in arc.commands)


async def test_a_terminal_that_goes_away_ends_the_console_and_gives_the_robot_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, beside: Callable[..., Any]
) -> None:
    monkeypatch.setenv("TERM", "xterm-256color")
    ours, theirs = pty.openpty()
    drawn = bytearray()
    loop = asyncio.get_running_loop()
    loop.add_reader(ours, lambda: drawn.extend(os.read(ours, 65536)))
    async with placer_behind_a_hub(tmp_path, monkeypatch, beside) as placer:
        placer.on_arc = grant_at_once(placer)
        async with asyncio.timeout(WITHIN_S):
            command = (sys.executable, "-m", "ui_console.cli", *ATTACH)
            process = await asyncio.create_subprocess_exec(
                *command, stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True
            )
            os.close(theirs)
            try:
                await placer.wait(lambda: b"scout1" in drawn)
                loop.remove_reader(ours)
                os.close(ours)
                await process.wait()
            finally:
                if process.returncode is None:
                    process.kill()
                    await process.wait()
            assert not placer.arcs


async def test_a_console_that_crashes_gives_back_its_robot_and_its_terminal_and_says_so_by_its_exit_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, beside: Callable[..., Any]
) -> None:
    monkeypatch.setenv("TERM", "xterm-256color")
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(ours, (40, 132))
    drawn = bytearray()
    loop = asyncio.get_running_loop()
    loop.add_reader(ours, lambda: drawn.extend(os.read(ours, 65536)))

    def echoes() -> bool:
        return bool(termios.tcgetattr(theirs)[3] & termios.ECHO)

    async with placer_behind_a_hub(tmp_path, monkeypatch, beside) as placer, AsyncExitStack() as leftovers:
        placer.on_arc = grant_at_once(placer)
        async with asyncio.timeout(WITHIN_S):
            command = (sys.executable, crashing_console.__file__, "scout-console", *ATTACH)
            process = await asyncio.create_subprocess_exec(
                *command, stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True
            )
            leftovers.callback(lambda: process.returncode is None and process.kill())
            await placer.wait(lambda: placer.arcs)
            await placer.wait(lambda: b"scout1" in drawn)
            assert not echoes()
            os.write(ours, b"j")
            assert await process.wait() == 1
            await placer.wait(lambda: b"broken on purpose" in drawn)
            assert echoes()
            assert not placer.arcs
    loop.remove_reader(ours)
    os.close(ours)
    os.close(theirs)
