"""The recorded events of simulated missions, through the scheduler once more, give the grants of the mission."""

from __future__ import annotations

from typing import Any

import pytest
from recorded_missions import record_seed

from backbone.addresses import RC_MANAGER
from backbone.naming import component_of
from backbone.rc_manager.messages import Decided, ScheduleSnapshot
from backbone.recording.decisions import decided_anew
from backbone.recording.reader import Recording
from backbone.recording.revival import revived
from backbone.scheduling import snapshot
from backbone.scheduling.events import Record
from backbone.scheduling.schedule_manager import ScheduleManager
from backbone.scheduling.trace import Line

ALL_SEEDS, THOROUGH_SEEDS = 20, 4


def length(seed: int, *, chaos: bool) -> list[pytest.MarkDecorator]:
    """Return the mark of a mission: chaotic ones of the first seed are quick, as they have all that others have."""
    if seed >= THOROUGH_SEEDS:
        return [pytest.mark.slow]
    return [] if seed == 0 and chaos else [pytest.mark.thorough]


seeds = [
    pytest.param(seed, chaos, is_supervised, marks=length(seed, chaos=chaos))
    for seed in range(ALL_SEEDS)
    for chaos in (False, True)
    for is_supervised in (False, True)
]


def granted_anew(recording: Recording) -> list[dict[str, Any]]:
    """Return the grants that a schedule manager decides on the recorded events, as a mission notes them."""
    manager: ScheduleManager | None = None
    lines = list[Line]()
    of_it = recording.messages((f"{RC_MANAGER}/decisions",), source=RC_MANAGER)
    for message in sorted(of_it, key=lambda one: (one.at_s, one.sequence)):
        if message.schema == "Decided/1":
            decided = revived(Decided, message.body)
            assert manager is not None
            told = manager.handle(decided.event, decided.at_s)
            lines += [one.line for one in told if isinstance(one, Record) and one.line["ev"] == "grant"]
        elif message.schema == "ScheduleSnapshot/1" and message.body["number"] == 0:
            manager = snapshot.read(revived(ScheduleSnapshot, message.body).state)
    return [{name: value for name, value in line.items() if name not in {"ev", "t"}} for line in lines]


@pytest.mark.parametrize(("seed", "chaos", "is_supervised"), seeds)
def test_the_grants_and_all_other_decisions_are_those_of_the_mission(seed: int, chaos: bool, is_supervised: bool):
    """The grants are compared with what the mission itself noted, which is not in the recording."""
    recording, run = record_seed(seed, chaos=chaos, is_supervised=is_supervised)
    noted = [dict(one.values) for one in run.happenings if (one.who, one.what) == (component_of(RC_MANAGER), "grant")]
    assert noted
    assert granted_anew(recording) == noted
    found = decided_anew(recording)
    assert (found.difference, found.missing) == (None, 0)
    assert (found.grants, found.decisions > 10) == (len(noted), True)
