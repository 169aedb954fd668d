"""A command that serves other tools at a port."""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

from running_mission import BIN, RunningMission


@contextmanager
def tool_at(mission: RunningMission, command: str, port: int) -> Iterator[None]:
    """Run a command that serves at a port; it listens when this is entered, and has ended well afterwards."""
    words = [str(BIN / "scout-backbone"), command, "--port", str(port), "--mission", mission.name]
    server = subprocess.Popen(words, env=mission.environment, stderr=subprocess.PIPE, text=True)
    assert server.stderr is not None
    try:
        said = server.stderr.readline()
        assert f"127.0.0.1:{port}" in said, said + server.stderr.read()
        yield
        server.send_signal(signal.SIGINT)
        _none, rest = server.communicate(timeout=20)
        assert server.returncode == 0, rest
    finally:
        server.kill()
        server.wait(10)
        server.stderr.close()
