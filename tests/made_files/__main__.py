"""``python -m tests.made_files``: see the package."""

from __future__ import annotations

from . import write_all

if __name__ == "__main__":
    write_all()
