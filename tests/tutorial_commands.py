"""The commands of a tutorial, run as they stand, and compared with what it says is printed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

BIN = Path(sys.executable).parent
ASKING = ("scout-backbone status", "scout-backbone why", "scout-backbone story", "scout-console look")
ENDS_WITHIN_S = 120.0  # the longest command of a tutorial is a whole mission of half a minute
TRUE_WITHIN_S = 20.0  # what a command shows may need a turn to become so; only commands that ask are run again


def run_all(tutorial: Path, folder: Path) -> None:
    """Run every command in this folder; afterwards end missions that are still up, in any case."""
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder), "COLUMNS": "200"}
    try:
        for command, expected in commands(tutorial):
            deadline = time.monotonic() + TRUE_WITHIN_S
            done = run(command, folder, environment)
            while not is_printed(expected, done.stdout):
                asks = any(words in command for words in ASKING) or command.endswith(" tree")
                if not asks or time.monotonic() > deadline:
                    pytest.fail(f"{command}\n{done.stdout}\nnot as told:\n{expected}")
                done = run(command, folder, environment)
            assert done.returncode == 0, f"{command}\n{done.stdout}"
    finally:
        if any((folder / "scout-backbone").glob("*")):
            run(".venv/bin/scout-backbone down", folder, environment)


def commands(tutorial: Path) -> list[tuple[str, list[str]]]:
    """Return each command of the tutorial with the lines it says are printed."""
    found: list[tuple[str, list[str]]] = []
    for block in re.findall(r"```console\n(.*?)```", tutorial.read_text(), re.DOTALL):
        for line in block.splitlines():
            if line.startswith("$ "):
                found.append((line[2:], []))
            else:
                found[-1][1].append(line)
    return found


def is_printed(expected: list[str], printed: str) -> bool:
    """Return whether the lines are there in this order, with others between them; numbers may differ."""
    lines = iter(printed.splitlines())
    return all(any(pattern(line).fullmatch(squeezed(found)) for found in lines) for line in expected)


def pattern(line: str) -> re.Pattern[str]:
    parts = [re.escape(squeezed(part)) for part in line.split("…")]
    return re.compile(".*".join(re.sub(r"\d+(\\\.\d+)?", r"\\d+(?:\\.\\d+)?", part) for part in parts))


def squeezed(text: str) -> str:
    return " ".join(text.split())


def run(command: str, folder: Path, environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    words = command.replace(".venv/bin/", f"{BIN}/")
    return subprocess.run(
        ["bash", "-c", words],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=ENDS_WITHIN_S,
        check=False,
    )
