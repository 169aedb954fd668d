"""``python -m tests.trace_checker FILE... [--tol SECONDS]``: exit code 0 if nothing is wrong, else 1."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from .replay import check
from .trace_format import Malformed, read_lines
from .violation import NAMES


def main(arguments: Sequence[str] | None = None) -> int:
    """Print each violation in each file with the rule that it breaks; return the exit code."""
    parser = argparse.ArgumentParser(prog="trace_checker", description="Check schedule traces against the rules.")
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="JSON lines, as up --trace writes them")
    parser.add_argument("--tol", type=float, metavar="SECONDS", help="instead of the trace's own tolerance")
    given = parser.parse_args(arguments)
    wrong = 0
    for file in given.files:
        try:
            lines = list(read_lines(file))
        except (Malformed, OSError) as error:
            print(f"{file}: FORM {error}")
            wrong += 1
            continue
        found = check(lines, given.tol)
        for one in found:
            print(f"{file}: {one} [{NAMES[one.code]}]")
        print(f"{file}: {len(lines)} lines, {len(found)} violation(s)")
        wrong += len(found)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
