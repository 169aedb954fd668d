"""Lines of a console without a screen: a reader that does not read holds up nothing, one that has gone ends it."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytestmark = pytest.mark.processes

WITHIN_S = 30.0
PROGRAM = """
import asyncio, signal, sys
from ui_console.session.joining import line_writer

async def main():
    ended = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, ended.set)
    async with line_writer() as write:
        for _ in range(100):
            write(b"x" * 10_000)
        print("GOES ON", file=sys.stderr, flush=True)
        await ended.wait()
    print("IN GOOD ORDER", file=sys.stderr, flush=True)

asyncio.run(main())
"""


def begun() -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def test_lines_that_nobody_reads_hold_up_neither_the_console_nor_its_end() -> None:
    with begun() as console:
        try:
            assert console.stderr is not None
            assert console.stderr.readline() == b"GOES ON\n"
            console.terminate()
            assert console.stderr.readline() == b"IN GOOD ORDER\n"
            assert console.wait(WITHIN_S) == 0
        finally:
            console.kill()


def test_a_reader_that_has_gone_ends_the_console_in_good_order() -> None:
    with begun() as console:
        try:
            assert console.stdout is not None
            assert console.stderr is not None
            console.stdout.close()
            assert console.stderr.read() == b"GOES ON\nIN GOOD ORDER\n"
            assert console.wait(WITHIN_S) == 0
        finally:
            console.kill()
