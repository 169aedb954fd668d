"""A terminal that does not read holds up nobody who writes."""

from __future__ import annotations

import os
import threading
import time

from backbone.command_line.terminal_output import BEHIND_S, MOST_WAITING_BYTES, TerminalOutput

WITHIN_S = 10.0


def test_texts_are_dropped_whole_while_the_reader_is_behind_and_then_it_is_told() -> None:
    reader, its_end = os.pipe()
    told = threading.Event()
    output = TerminalOutput(its_end, told.set)
    first, last = "a" * 1_000_000, "b"
    output.write(first)
    output.write(last)
    time.sleep(BEHIND_S * 1.1)
    output.write("dropped")
    output.drops = False
    output.write("kept")
    assert not output.wait_written(0.0)
    expected = (first + last + "kept").encode()
    read = b""
    while len(read) < len(expected):
        read += os.read(reader, 1 << 16)
    assert read == expected
    assert told.wait(WITHIN_S)
    assert output.wait_written(WITHIN_S)
    os.close(reader)
    output.write("to nobody")
    assert output.wait_written(WITHIN_S)
    os.close(its_end)


def test_lines_of_a_terminal_that_is_paused_are_kept_up_to_a_limit() -> None:
    reader, its_end = os.pipe()
    told = threading.Event()
    output = TerminalOutput(its_end, told.set)
    output.drops = False
    kept = "a" * MOST_WAITING_BYTES
    output.write(kept)
    time.sleep(BEHIND_S * 1.1)
    output.write("b")
    output.write("dropped")
    read = b""
    while len(read) <= len(kept):
        read += os.read(reader, 1 << 16)
    assert read == (kept + "b").encode()
    assert told.wait(WITHIN_S)
    os.close(reader)
    os.close(its_end)
