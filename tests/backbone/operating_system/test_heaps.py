"""The threads of a process share few heaps."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest

from backbone.operating_system.heaps import FEW

PROGRAM = """
import ctypes, sys, threading
from backbone.operating_system.heaps import share_heaps
libc = ctypes.CDLL(None)
if not hasattr(libc, "malloc_info"):
    sys.exit(77)
if sys.argv[1] == "few":
    share_heaps()
all_there = threading.Barrier(12)
def allocate():
    all_there.wait()
    bytes(1000).hex() * 3
    all_there.wait()
threads = [threading.Thread(target=allocate) for _ in range(12)]
for thread in threads: thread.start()
for thread in threads: thread.join()
libc.fdopen.restype = ctypes.c_void_p
out = ctypes.c_void_p(libc.fdopen(1, b"w"))
libc.malloc_info(0, out)
libc.fflush(out)
"""


def heaps(how: str) -> int:
    done = subprocess.run([sys.executable, "-c", PROGRAM, how], capture_output=True, text=True, check=False)
    if done.returncode == 77:
        pytest.skip("this C library does not count its heaps")
    assert done.returncode == 0, done.stderr
    return len(re.findall("<heap nr=", done.stdout))


@pytest.mark.processes
def test_threads_share_few_heaps_where_each_would_have_its_own() -> None:
    assert heaps("few") <= FEW < heaps("as it is")
