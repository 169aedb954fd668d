"""Which tests run when nothing is said: those of a few seconds.

* ``slow`` marks the long experiments, ``thorough`` the tests that take seconds and whose mechanism a shorter one tries
  too. Both are left out unless the expression of ``-m`` names their marker or the command names the test
  (``file.py::test``).
* ``pytest -m "not processes"`` leaves them out too: an expression that does not name them does not ask for them.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

import pytest

LONG = ("slow", "thorough")  # the longer first


def is_left_out(markers: Collection[str], expression: str, arguments: Sequence[str]) -> bool:
    """Return whether a command leaves a test out: a slow case of a thorough test is slow.

    Args:
        markers: Of the test.
        expression: Of ``-m``.
        arguments: Files, folders and tests that the command names.
    """
    length = next((name for name in LONG if name in markers), "")
    is_named = any("::" in argument for argument in arguments) or length in re.findall(r"\w+", expression)
    return bool(length) and not is_named


class OnlyQuick:
    """Leaves long tests out unless they are asked for."""

    def pytest_collection_modifyitems(self, config: pytest.Config, items: list[pytest.Item]) -> None:
        """Deselect the long tests that nothing names."""
        gone = {
            item
            for item in items
            if is_left_out({mark.name for mark in item.iter_markers()}, str(config.option.markexpr), config.args)
        }
        if gone:
            config.hook.pytest_deselected(items=[item for item in items if item in gone])
            items[:] = [item for item in items if item not in gone]
