"""Lines reach a reader in their order; a reader that does not read holds up no end."""

from __future__ import annotations

import subprocess
import sys

import pytest

SCRIPT = """
import asyncio, sys
from backbone.command_line import line_printer
line_printer.READ_EACH_S = float(sys.argv[1])
async def main():
    printer = line_printer.LinePrinter(lambda: None)
    for number in range(1000):
        printer.put(f"{number} {'x' * 500}")
    await printer.end()
    print(printer.dropped, printer.is_stuck, file=sys.stderr)
asyncio.run(main())
"""

pytestmark = [pytest.mark.processes, pytest.mark.timeout(60)]


def test_a_reader_gets_each_line_in_order() -> None:
    done = subprocess.run([sys.executable, "-c", SCRIPT, "20"], capture_output=True, text=True, timeout=30, check=True)
    assert [int(line.partition(" ")[0]) for line in done.stdout.splitlines()] == [*range(1000)]
    assert done.stderr == "0 False\n"


def test_a_reader_that_does_not_read_holds_up_no_end() -> None:
    words = [sys.executable, "-c", SCRIPT, "0.2"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as printing:
        try:
            assert printing.wait(30) == 0
            assert printing.stderr is not None
            dropped, is_stuck = printing.stderr.read().split()
            assert 0 < int(dropped) < 1000
            assert is_stuck == "True"
        finally:
            printing.kill()
