"""Pages of shared libraries that this process has read: unmapping those that it no longer needs."""

from __future__ import annotations

import ctypes
import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

_MAPS = Path("/proc/self/smaps")
_DONTNEED = 4  # MADV_DONTNEED of linux/mman.h
_LIBRARY = re.compile(r"([0-9a-f]+)-([0-9a-f]+) r-[-x]p \S+ \S+ \S+ +/.*\.so[.\d]*$")


def unmap_read_pages() -> None:
    """Unmap all pages of shared libraries that this process has not written; the next use of a page maps it again.

    When: after much has been loaded. A library reads most of its pages only while it is loaded: relocations, symbols,
    the compiler of a renderer. The system has these pages in its cache, and can free them there. Not: while another
    thread unloads a library.
    """
    with suppress(OSError, AttributeError):  # another operating system
        madvise = ctypes.CDLL(None).madvise
        with _MAPS.open() as lines:
            for begin, end in read_only_parts(lines):
                madvise(ctypes.c_void_p(begin), ctypes.c_size_t(end - begin), _DONTNEED)


def read_only_parts(lines: Iterable[str]) -> Iterator[tuple[int, int]]:
    """Yield the first address and the end of each part of a library that was never written in this process.

    A part that the loader has relocated is read-only too, but its content is not that of the file.

    Args:
        lines: Those of ``smaps``, proc_pid_smaps(5).

    Example:
        >>> code = ["7f00-8f00 r-xp 0 08:01 7 /usr/lib/libm.so.6", "Rss: 8 kB", "Anonymous: 0 kB"]
        >>> relocated = ["9f00-af00 r--p 0 08:01 7 /usr/lib/libm.so.6", "Rss: 8 kB", "Anonymous: 4 kB"]
        >>> list(read_only_parts([*code, *relocated]))
        [(32512, 36608)]
    """
    part: tuple[int, int] | None = None
    for line in lines:
        if "-" in line.partition(" ")[0]:
            found = _LIBRARY.match(line)
            part = None if found is None else (int(found[1], 16), int(found[2], 16))
        elif part is not None and line.split() == ["Anonymous:", "0", "kB"]:
            yield part
