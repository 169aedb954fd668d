"""The attributes that ``set`` shows of a console: what its request has, not what it once asked for."""

from __future__ import annotations

import pytest

from backbone.command_line.attributes import ShownAttributes
from backbone.scheduling.requests import PathNode, RequestState
from backbone.scheduling.views import RequestAttributes

CONSOLE = "ui_console/console-7"
OWN = RequestAttributes(
    "console-7-drive", CONSOLE, RequestState.RUNNING, {}, 3.0, 3.0, [PathNode("console-7", 20)], True, False
)
PARAMETERS = {"robot": "scout1", "priority": 100, "minimum_runtime_s": 5.0}


@pytest.mark.parametrize(
    ("attribute", "told"),
    [
        ("priority", "console-7-drive: priority is 20 (console-7:20)"),
        ("minimum_runtime_s", "console-7-drive: minimum_runtime_s is 3"),
        ("robot", 'console-7: robot is "scout1"'),
    ],
)
def test_a_console_that_claims_shows_the_changed_values_of_its_request(attribute: str, told: str) -> None:
    assert ShownAttributes("console-7", [OWN], PARAMETERS).of(attribute) == [told]


def test_a_console_without_a_claim_shows_its_parameters() -> None:
    assert ShownAttributes("console-7", [], PARAMETERS).of("priority") == ["console-7: priority is 100"]


def test_a_parameter_of_a_parent_is_not_hidden_by_requests_of_its_children() -> None:
    parent = ShownAttributes("parent", [OWN], {"priority": "high"})
    assert parent.of("priority") == ['parent: priority is "high"']
