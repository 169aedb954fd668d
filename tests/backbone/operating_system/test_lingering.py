"""A socket lingers not where lingering is ignored; in a process of its own, because a filter stays."""

from __future__ import annotations

import subprocess
import sys

import pytest

PROGRAM = """
import socket, struct, threading
from backbone.operating_system.lingering import ignore_lingering
print(ignore_lingering())
def look():
    with socket.socket() as one:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 10))
        one.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        print(struct.unpack("ii", one.getsockopt(socket.SOL_SOCKET, socket.SO_LINGER, 8)))
        print(one.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE))
thread = threading.Thread(target=look)
thread.start()
thread.join()
"""


@pytest.mark.processes
def test_lingering_is_ignored_and_other_options_are_not() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.splitlines() == ["True", "(0, 0)", "1"]
