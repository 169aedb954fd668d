"""Pages of libraries that were only read are unmapped; what a process has written stays."""

from __future__ import annotations

import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.operating_system.library_pages import read_only_parts

PROGRAM = """
import ssl, sqlite3, ctypes
from backbone.operating_system.library_pages import unmap_read_pages

def mapped_kb():
    return sum(int(line.split()[1]) for line in open("/proc/self/smaps") if line.startswith(("Shared_C", "Private_C")))

before_kb = mapped_kb()
unmap_read_pages()
after_kb = mapped_kb()
assert sqlite3.connect(":memory:").execute("select 6 * 7").fetchone() == (42,)
assert ssl.create_default_context().check_hostname
print(before_kb, after_kb)
"""

parts = st.tuples(
    st.sampled_from(["r-xp", "r--p", "rw-p", "rwxp", "r-xs", "---p"]),
    st.sampled_from(["/usr/lib/libm.so.6", "/opt/a b/x.abi3.so", "/usr/bin/python3", "[heap]", "/var/a.mcap", ""]),
    st.sampled_from([0, 4]),
)


@given(st.lists(parts, max_size=8))
def test_only_unwritten_parts_of_libraries_are_chosen(given_parts: list[tuple[str, str, int]]) -> None:
    lines, expected = [], []
    for number, (rights, path, anonymous_kb) in enumerate(given_parts):
        begin, end = (number + 1) << 16, ((number + 1) << 16) + 4096
        lines += [f"{begin:x}-{end:x} {rights} 00000000 08:01 77    {path}\n", "Rss:    4 kB\n"]
        lines += [f"Anonymous:    {anonymous_kb} kB\n", "VmFlags: rd mr mw\n"]
        if rights in ("r-xp", "r--p") and ".so" in path and anonymous_kb == 0:
            expected.append((begin, end))
    assert list(read_only_parts(lines)) == expected


@pytest.mark.processes
def test_a_process_goes_on_with_fewer_pages() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], check=True, timeout=60, capture_output=True, text=True)
    before_kb, after_kb = map(int, done.stdout.split())
    assert after_kb < before_kb / 2
