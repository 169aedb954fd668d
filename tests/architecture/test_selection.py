"""Which tests run when a command says little."""

from __future__ import annotations

import pytest
from selection import is_left_out

ONE = "tests/multiprocess/test_tutorial.py::test_every_command"


@pytest.mark.parametrize(
    ("markers", "expression", "arguments", "is_out"),
    [
        ({"processes"}, "", [], False),
        ({"thorough"}, "", [], True),
        ({"slow"}, "not processes", ["tests/backbone"], True),
        ({"thorough"}, "thorough", [], False),
        ({"slow"}, "thorough", [], True),
        ({"thorough", "slow"}, "thorough", [], True),
        ({"thorough", "slow"}, "slow and not processes", [], False),
        ({"thorough"}, "not slowly", [], True),
        ({"slow"}, "", [ONE], False),
    ],
)
def test_long_tests_run_only_if_something_names_them(
    markers: set[str], expression: str, arguments: list[str], is_out: bool
) -> None:
    assert is_left_out(markers, expression, arguments) is is_out
