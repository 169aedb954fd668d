"""The last line of a mission that failed names the component at fault."""

from __future__ import annotations

import pytest

from backbone.command_line.mission_console import last_lines
from backbone.creator.messages import EndedBy, ProcessEnded, StartFailed
from backbone.errors import BackboneError
from backbone.launcher.outcome import Outcome, with_signals


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


def test_many_components_that_needed_a_signal_are_counted() -> None:
    """``down`` of sixty robots on a full machine ended with a line of 73 names."""
    termed = [ProcessEnded(f"scout{number}", EndedBy.SIGTERM, 0) for number in range(1, 61)]
    assert with_signals([*termed, ProcessEnded("radio", EndedBy.SIGKILL, 0)]) == (
        "needed a signal to end: 60 components (scout1, scout2, scout3, scout4, scout5, scout6, scout7, scout8 and "
        "52 more) by sigterm, 1 component (radio) by sigkill"
    )
    assert with_signals(termed[:2]) == "needed a signal to end: scout1 (sigterm), scout2 (sigterm)"
