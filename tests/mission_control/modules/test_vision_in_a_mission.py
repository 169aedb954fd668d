"""The vision of a watching behavior as a unit of its mission: it sees what the behavior's own detector sees."""

from __future__ import annotations

import re
from pathlib import Path

import msgspec
import pytest

from backbone.bus.clock import run_virtual
from backbone.keys import Conversation
from backbone.mission.reader import read_mission
from mission_control.laboratory.simulation.whole_mission import mission_in_one_process
from mission_control.messages import MotionSeen

EXAMPLE = Path(__file__).parents[3] / "docs/examples/vision.xml"

pytestmark = pytest.mark.processes


def watched(file: Path, for_s: float) -> tuple[list[MotionSeen], dict[str, float]]:
    """Return what the behavior published, and its statistics."""
    seen: list[MotionSeen] = []

    async def main() -> dict[str, float]:
        async with mission_in_one_process(read_mission(file)) as running:
            at = "mission_control/watch"
            running.bus.subscribe(at, Conversation.EVENTS, MotionSeen, lambda one: seen.append(one.body))
            await running.clock.sleep_s(for_s)
            return await running.statistics("watch")

    return seen, run_virtual(main())


def test_the_modules_and_the_behavior_by_itself_see_the_same_to_the_byte(tmp_path: Path) -> None:
    by_itself = tmp_path / "by_itself.xml"
    text = re.sub(r"<modules>.*</modules>", "", EXAMPLE.read_text(), flags=re.DOTALL)
    by_itself.write_text(text.replace('<parameter name="vision" value="vision"/>', ""))
    seen, counted = watched(EXAMPLE, 12.0)
    expected, counted_by_itself = watched(by_itself, 12.0)
    assert len(expected) > 2
    assert msgspec.msgpack.encode(seen) == msgspec.msgpack.encode(expected)
    assert [counted[name] for name in ("events", "frames_rejected")] == [
        counted_by_itself[name] for name in ("events", "frames_rejected")
    ]
