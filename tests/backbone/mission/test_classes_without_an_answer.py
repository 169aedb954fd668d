"""A class that does not say whether it starts with its parameters is warned of; all other checks are made."""

from __future__ import annotations

from pathlib import Path

import pytest
from mission_files import MISSION_XML

from backbone.mission import class_asking
from backbone.mission.reader import MissionInvalid, read_written_mission

OWN = """
import msgspec, os, time
from mission_control.behavior import Behavior, BehaviorParameters
class P(BehaviorParameters, frozen=True, kw_only=True):
    view_s: float
    def __post_init__(self):
        {what}
class Own(Behavior[P]):
    parameters_type = P
"""
TYPE = '<types><type name="own" class="{module}:Own" subsystem="mission_control"/></types>'
MINE = '<behavior type="own" name="{name}" priority="1"><parameter name="view_s" value="1"/></behavior>'
WRONG = (
    '<behavior type="condition" name="wrong" priority="1"><parameter name="message" value="MotionSeen"/>'
    '<parameter name="equals" value="1"/></behavior>'
)


def warnings_about(what: str, module: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the warnings about a class whose parameters do this."""
    monkeypatch.syspath_prepend(folder)
    (folder / f"{module}.py").write_text(OWN.format(what=what))
    behaviors = f"{MINE.format(name='mine')}\n{MINE.format(name='too')}\n{WRONG}\n</behaviors>"
    text = MISSION_XML.read_text().replace("</behaviors>", behaviors)
    text = text.replace("<resources>", TYPE.format(module=module) + "<resources>")
    (folder / "m.xml").write_text(text)
    warnings = list[str]()
    with pytest.raises(MissionInvalid, match="field is empty") as invalid:
        read_written_mission(folder / "m.xml", warnings.append)
    assert len(invalid.value.faults) == 1
    line = text[: text.index(MINE.format(name="mine"))].count("\n") + 1
    assert all(warning.startswith(f"{folder / 'm.xml'}:{line}:") for warning in warnings)
    return warnings


def test_one_that_ends_its_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    [warning] = warnings_about("os._exit(3)", "own_ending", tmp_path, monkeypatch)
    assert ": warning: whether own_ending:Own starts with its parameters is unknown: the process" in warning
    assert "ends without an answer" in warning


@pytest.mark.thorough
def test_one_that_hangs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(class_asking, "WITHIN_S", 15.0)
    [warning] = warnings_about("time.sleep(99.0)", "own_hung", tmp_path, monkeypatch)
    place = f"{tmp_path / 'own_hung.py'}, line 7"
    assert f"is unknown: it does not judge its parameters within 15 s; it is at {place}" in warning
