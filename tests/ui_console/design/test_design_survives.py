"""Unsaved changes survive every end of the designer's server: real processes, real signals."""

from __future__ import annotations

import asyncio
import json
import re
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from design_hands import BIN, ROOT
from examples import rest_thorough
from websockets.asyncio.client import ClientConnection, connect

from ui_console.design.keeping import DraftFile, path_of_draft

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

WITHIN_S = 20.0
ASKED_TO_END = {signal.SIGINT: 130, signal.SIGTERM: 0, signal.SIGHUP: 0}
KILLED = (signal.SIGKILL, signal.SIGSEGV)


@contextmanager
def server(file: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Serve the designer of this file; yields the process and the page's address."""
    ignored = signal.signal(signal.SIGHUP, signal.SIG_DFL)  # these tests may run under nohup
    process = subprocess.Popen(
        [str(BIN / "scout-console"), "serve", "--design", str(file), "--port", "0"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    signal.signal(signal.SIGHUP, ignored)
    with process:
        try:
            assert process.stdout is not None
            yield process, process.stdout.readline().strip()
        finally:
            if process.poll() is None:
                process.kill()


async def heard(socket: ClientConnection, view: dict[str, Any], revision: int) -> dict[str, Any]:
    """Return the view once it shows this revision."""
    async with asyncio.timeout(WITHIN_S):
        while view.get("status", {}).get("revision") != revision or "element" not in view:
            view |= json.loads(await socket.recv()).get("view", {})
    return view


async def change_priority(address: str, revision: int, priority: str) -> None:
    """Change the mission's priority by a page, and return once it was done."""
    found = re.fullmatch(r"http://(\S+)/#token=(\S+)", address)
    assert found is not None, address
    async with connect(f"ws://{found[1]}/socket", compression=None, proxy=None) as socket:
        await socket.send(json.dumps({"do": "hello", "token": found[2]}))
        view = await heard(socket, {}, revision)
        change = {"do": "set", "revision": revision, "path": [], "name": "priority", "value": priority}
        await socket.send(json.dumps(change))
        await heard(socket, view, revision + 1)


def mission(folder: Path) -> Path:
    file = folder / "guard.xml"
    file.write_bytes((ROOT / "mission.xml").read_bytes())
    return file


def wait_kept(file: Path) -> None:
    """Return once the server has kept the unsaved changes."""
    deadline_s = time.monotonic() + WITHIN_S
    while not path_of_draft(str(file)).exists():
        assert time.monotonic() < deadline_s, "the draft was not kept"
        time.sleep(0.01)


def assert_not_saved(file: Path) -> None:
    assert file.read_bytes() == (ROOT / "mission.xml").read_bytes()


async def assert_goes_on(file: Path, priority: str) -> None:
    """Check that the next server has what was not saved."""
    draft = DraftFile(str(file)).resume()
    assert draft is not None
    assert draft.mission.text("priority") == priority
    with server(file) as (process, address):
        assert process.stderr is not None
        assert "goes on with the unsaved changes" in process.stderr.readline()
        await change_priority(address, 1, "77")
    assert_not_saved(file)


@pytest.mark.parametrize("number", rest_thorough(ASKED_TO_END))
async def test_a_signal_that_ends_the_server_loses_not_even_the_last_change(
    number: signal.Signals, tmp_path: Path
) -> None:
    file = mission(tmp_path)
    with server(file) as (process, address):
        for revision in range(1, 20):
            await change_priority(address, revision, str(100 + revision))
        process.send_signal(number)
        code = await asyncio.to_thread(process.wait, WITHIN_S)
    assert code == ASKED_TO_END[number]
    await assert_goes_on(file, "119")


@pytest.mark.parametrize("number", rest_thorough(KILLED))
async def test_a_server_that_crashes_loses_nothing_that_was_kept(number: signal.Signals, tmp_path: Path) -> None:
    file = mission(tmp_path)
    with server(file) as (process, address):
        await change_priority(address, 1, "55")
        await asyncio.to_thread(wait_kept, file)
        process.send_signal(number)
        assert await asyncio.to_thread(process.wait, WITHIN_S) == -number
    await assert_goes_on(file, "55")
