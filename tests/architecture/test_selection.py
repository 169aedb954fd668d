"""Which tests run when a command says little."""

from __future__ import annotations

import pytest
from selection import left_out


@pytest.mark.parametrize(
    ("expression", "arguments", "gone"),
    [
        ("", [], {"slow", "thorough"}),
        ("not processes", ["tests/backbone"], {"slow", "thorough"}),
        ("thorough", [], {"slow"}),
        ("slow and not processes", [], {"thorough"}),
        ("slow or thorough", [], set()),
        ("not slowly", [], {"slow", "thorough"}),
        ("", ["tests/multiprocess/test_tutorial.py::test_every_command"], set()),
    ],
)
def test_long_tests_run_only_if_something_names_them(expression: str, arguments: list[str], gone: set[str]) -> None:
    assert left_out(expression, arguments) == gone
