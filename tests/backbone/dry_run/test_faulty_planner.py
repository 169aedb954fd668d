"""A planner of one's own with a fault is refused by check, or at the latest by the dry run, and never ends it."""

from __future__ import annotations

import importlib
import threading
from pathlib import Path

import pytest

from backbone.command_line.rehearsing import print_dry_run
from backbone.dry_run import run
from backbone.launcher.endings import ExitCode
from backbone.mission.reader import MissionInvalid, read_mission

MISSION = (Path(__file__).parents[3] / "mission.xml").read_text()
HEAD = "from backbone.scheduling.whole_group import WholeGroupPlanner\nclass Own(WholeGroupPlanner):\n    "


def file_of(folder: Path, monkeypatch: pytest.MonkeyPatch, name: str, method: str) -> Path:
    monkeypatch.syspath_prepend(folder)
    (folder / f"{name}.py").write_text(f"{HEAD}{method}\n")
    planner = f'<parameter name="planner" value="{name}:Own"/>'
    file = folder / "mission.xml"
    file.write_text(MISSION.replace("<hosts>", f'<core><service type="rc_manager">{planner}</service></core><hosts>'))
    return file


@pytest.mark.parametrize(
    ("name", "method", "told"),
    [
        ("planner_made_otherwise", "def __init__(self): pass", "its constructor: too many positional arguments"),
        ("planner_of_no_arcs", "def order(self): return []", "order: too many positional arguments"),
        ("planner_awaited", "async def order(self, arcs): return []", "order is an 'async def'"),
    ],
)
def test_a_planner_that_cannot_be_made_or_called_is_refused_by_check(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, method: str, told: str
) -> None:
    with pytest.raises(MissionInvalid) as caught:
        read_mission(file_of(tmp_path, monkeypatch, name, method))
    [fault] = caught.value.faults
    assert f"{name}:Own: {told}" in fault.message


def test_a_planner_that_fails_at_work_is_refused_by_the_dry_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    method = "def order(self, arcs): return [one.nope for one in arcs]"
    mission = read_mission(file_of(tmp_path, monkeypatch, "planner_with_a_bug", method))
    assert print_dry_run(mission, None, None, None) is ExitCode.MISSION_INVALID
    told = capsys.readouterr().err
    assert "planner_with_a_bug:Own: AttributeError" in told
    assert "planner_with_a_bug.py, line 3" in told


@pytest.mark.parametrize(
    ("name", "method", "said"),
    [
        ("planner_of_nothing", "def order(self, arcs): return None", "Own.order returned None, not the list"),
        ("planner_that_exits", "def order(self, arcs): raise SystemExit(1)", "SystemExit: 1 ("),
    ],
)
def test_a_planner_that_returns_nothing_or_exits_is_named_by_the_dry_run(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    name: str,
    method: str,
    said: str,
) -> None:
    mission = read_mission(file_of(tmp_path, monkeypatch, name, method))
    assert print_dry_run(mission, None, None, None) is ExitCode.MISSION_INVALID
    assert f"{name}:Own: " in (told := capsys.readouterr().err)
    assert said in told


def test_a_planner_that_finds_its_own_fault_is_refused_by_the_dry_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    method = "def due(self, now_s): assert False, 'my own check'"
    mission = read_mission(file_of(tmp_path, monkeypatch, "planner_that_asserts", method))
    assert print_dry_run(mission, None, None, None) is ExitCode.MISSION_INVALID
    assert "planner_that_asserts:Own: AssertionError: my own check" in capsys.readouterr().err


def test_a_planner_that_hangs_is_refused_by_the_dry_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ends = threading.Event()
    method = "ends = None\n    def order(self, arcs):\n        while not self.ends.wait(0.01): pass"
    mission = read_mission(file_of(tmp_path, monkeypatch, "planner_that_hangs", method))
    monkeypatch.setattr(importlib.import_module("planner_that_hangs").Own, "ends", ends)
    monkeypatch.setattr(run, "DECIDES_WITHIN_S", 0.5)
    assert print_dry_run(mission, None, None, None) is ExitCode.MISSION_INVALID
    ends.set()
    assert "planner_that_hangs:Own: it does not return within 0.5 s; it is at " in capsys.readouterr().err


LOCKED = "def __init__(self, table, *, slack_s):\n        super().__init__(table, slack_s=slack_s); "


def test_a_planner_that_cannot_be_copied_is_refused_by_the_dry_run_with_how_to_write_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    method = f"{LOCKED}import threading; self.lock = threading.Lock()"
    mission = read_mission(file_of(tmp_path, monkeypatch, "planner_with_a_lock", method))
    assert print_dry_run(mission, None, None, None) is ExitCode.MISSION_INVALID
    told = capsys.readouterr().err
    assert "planner_with_a_lock:Own cannot be copied: TypeError: cannot pickle '_thread.lock' object" in told
    assert "keep locks, threads and open files out of its attributes, or write a __deepcopy__" in told


def test_a_planner_whose_starts_are_no_times_is_refused_by_the_dry_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """``status`` and ``why`` showed a start at "nan s"."""
    method = (
        "def due(self, now_s): return None\n    "
        "def slots_around(self, arc, now_s): "
        "return [one._replace(start_s=float('nan')) for one in super().slots_around(arc, now_s)]"
    )
    mission = read_mission(file_of(tmp_path, monkeypatch, "planner_of_no_times", method))
    assert print_dry_run(mission, None, None, None) is ExitCode.MISSION_INVALID
    told = capsys.readouterr().err
    assert "planner_of_no_times:Own: AssertionError: the planner's start of watch-scout1-capture is nan" in told


def test_a_planner_that_omits_the_arc_it_is_asked_about_is_named_with_the_arc(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """``why`` ended the RC manager with "StopIteration"."""
    method = (
        "def due(self, now_s): return None\n    "
        "def slots_around(self, arc, now_s): "
        "return [one for one in super().slots_around(arc, now_s) if one.arc is not arc]"
    )
    mission = read_mission(file_of(tmp_path, monkeypatch, "planner_that_omits", method))
    assert print_dry_run(mission, None, None, None) is ExitCode.MISSION_INVALID
    told = capsys.readouterr().err
    assert "planner_that_omits:Own: AssertionError" in told
    assert "slots_around(watch-scout1-capture) has no slot of watch-scout1-capture" in told
