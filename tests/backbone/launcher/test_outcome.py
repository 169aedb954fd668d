"""The last line of a mission that failed names the component at fault."""

from __future__ import annotations

import pytest

from backbone.command_line.mission_console import last_lines
from backbone.creator.messages import StartFailed
from backbone.errors import BackboneError
from backbone.launcher.outcome import Outcome


@pytest.mark.parametrize(
    ("failure", "line"),
    [
        (StartFailed("no /dev/ttyUSB0", remedy="Plug it in.", name="radio2"), "radio2: no /dev/ttyUSB0 (Plug it in.)"),
        (StartFailed("radio2: killed", remedy="Mend it.", name="radio2"), "radio2: killed (Mend it.)"),
        (StartFailed("no host", remedy="Mend it."), "no host (Mend it.)"),
        (
            StartFailed(
                "bad1: exit code 1: Broken: no map (bad.py, line 26)\n  File …", remedy="Mend it.", name="bad1"
            ),
            "bad1: exit code 1: Broken: no map (bad.py, line 26) (Mend it.)\n  File …",
        ),
        (BackboneError("the hub hangs"), "the hub hangs"),
    ],
)
def test_a_failure_names_the_component_that_did_not_start_once(failure: BackboneError, line: str) -> None:
    assert last_lines(Outcome(failure=failure)) == [f"the mission failed: {line}"]
