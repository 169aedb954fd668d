"""Which tests run when nothing is said: those of a few seconds.

* ``slow`` marks the long experiments, ``thorough`` the tests that take longer than some three seconds on a calm
  machine. Both are left out unless the expression of ``-m`` names their marker or the command names the test
  (``file.py::test``).
* ``pytest -m "not processes"`` leaves them out too: an expression that does not name them does not ask for them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import pytest


def left_out(expression: str, arguments: Sequence[str]) -> set[str]:
    """Return the markers of tests that this command leaves out.

    Args:
        expression: Of ``-m``.
        arguments: Files, folders and tests that the command names.
    """
    if any("::" in argument for argument in arguments):
        return set()
    return {"slow", "thorough"} - set(re.findall(r"\w+", expression))


class OnlyQuick:
    """Leaves long tests out unless they are asked for."""

    def pytest_collection_modifyitems(self, config: pytest.Config, items: list[pytest.Item]) -> None:
        """Deselect the long tests that nothing names."""
        markers = left_out(str(config.option.markexpr), config.args)
        long = [item for item in items if any(item.get_closest_marker(name) is not None for name in markers)]
        if long:
            config.hook.pytest_deselected(items=long)
            gone = set(long)
            items[:] = [item for item in items if item not in gone]
