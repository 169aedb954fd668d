"""Where the extra is not installed, a walker is refused with a remedy, before anything starts."""

from __future__ import annotations

import sys

import pytest

from backbone.component.class_path import load_class
from backbone.mission.class_probe import facts_of
from resource_pool.robots.walker.extra import NoMink

RC = "resource_pool.robots.walker.rc:WalkerRc"
ARC = "resource_pool.robots.walker.arcs:WalkerDriveArc"


@pytest.fixture
def no_mink(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let mink and all that imports it be new to this process, and mink missing."""
    for module in ("kinematics", "motion", "report", "rc"):
        monkeypatch.delitem(sys.modules, f"resource_pool.robots.walker.{module}", raising=False)
    monkeypatch.setitem(sys.modules, "mink", None)


@pytest.mark.usefixtures("no_mink")
def test_its_rc_is_refused_with_the_remedy() -> None:
    with pytest.raises(NoMink) as refusal:
        load_class(RC)
    assert (refusal.value.code, "mink" in refusal.value.detail) == ("walker.no_mink", True)
    assert "pip install 'scout-backbone[walker]'" in refusal.value.remedy


@pytest.mark.usefixtures("no_mink")
def test_the_check_of_a_mission_file_learns_it() -> None:
    assert facts_of(ARC).failure == ""
    failure = facts_of(RC).failure
    assert "needs mink" in failure
    assert "pip install 'scout-backbone[walker]'" in failure
