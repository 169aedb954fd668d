"""The page of a mission that is up, served by the real command."""

from __future__ import annotations

import contextlib
import re
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from running_mission import BIN, RunningMission


@dataclass
class Served:
    """A mission with its web console.

    Attributes:
        mission: The mission.
        port: Where the page is served.
        token: What opens it.
        process: The server's.
    """

    mission: RunningMission
    port: int
    token: str
    process: subprocess.Popen[str]


@contextlib.contextmanager
def serving(mission: RunningMission, port: int = 0) -> Iterator[Served]:
    """Serve the mission's console until the block ends."""
    said = Path(mission.environment["XDG_RUNTIME_DIR"]) / f"serve-{port}.log"
    with said.open("w") as errors:
        process = subprocess.Popen(
            [str(BIN / "scout-console"), "serve", "--port", str(port), "--mission", mission.name],
            env=mission.environment,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
        )
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        found = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/#token=(\S+)\n", line)
        assert found is not None, f"{line!r}\n{said.read_text()}"
        yield Served(mission, int(found[1]), found[2], process)
    finally:
        if process.poll() is None:
            process.kill()
        process.wait(10)
        assert process.stdout is not None
        process.stdout.close()
