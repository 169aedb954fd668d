"""A behavior that could do nothing, because it gets no ARC or no pictures, is refused before anything starts."""

from __future__ import annotations

from pathlib import Path

import pytest
from mission_files import MISSION_XML, faults_in

from backbone.mission.class_probe import facts_of
from mission_control.behavior import Behavior, BehaviorParameters
from resource_pool.arc_client import Frame

MISSION = MISSION_XML.read_text()
ARC = '<arc kind="capture" minimum-runtime-s="5" period-s="0.1"><wish type="scout" name="scout1"/></arc>'
GO_TO = (
    '<behavior type="go_to" name="go" priority="1"><parameter name="x_m" value="1"/><parameter name="y_m" value="1"/>'
    '<parameter name="localizer" value="localizer"/></behavior></behaviors>'
)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        (ARC, "", "watch_for_motion watch-scout1 has no ARC, and needs one"),
        (
            ARC,
            ARC.replace("capture", "drive"),
            "an ARC of kind drive gives no pictures, which watch-scout1 needs",
        ),
        ("</behaviors>", GO_TO, "go_to go has no ARC, and needs one"),
    ],
)
def test_a_behavior_without_what_it_needs_is_refused(tmp_path: Path, before: str, after: str, message: str) -> None:
    assert before in MISSION
    [fault] = faults_in(tmp_path, MISSION.replace(before, after))
    assert fault.message == message
    assert 'kind="' in fault.remedy


class Watcher(Behavior[BehaviorParameters]):
    def see(self, frame: Frame) -> None:
        pass


class LooksSometimes(Watcher):
    needs_arc = ""


class Bellringer(Behavior[BehaviorParameters]):
    async def act(self) -> None:
        pass


class Lookout(Bellringer):
    def see(self, frame: Frame) -> None:
        pass


class Idler(Bellringer):
    needs_arc = ""


class BusyIdler(Idler):
    async def act(self) -> None:
        pass


class ActsSometimes(LooksSometimes):
    async def act(self) -> None:
        pass


class AskingIdler(BusyIdler):
    needs_arc = "any"

    async def act(self) -> None:
        pass


class SeeingIdler(AskingIdler):
    def see(self, frame: Frame) -> None:
        pass


def test_a_class_of_ones_own_that_acts_needs_an_arc_unless_it_says_otherwise(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert facts_of(f"{__name__}:Bellringer").needs_arc == "any"
    assert facts_of(f"{__name__}:Lookout").needs_arc == "capture"
    assert facts_of(f"{__name__}:Idler").needs_arc == ""
    lines = ["from mission_control.behavior import Behavior", "class Own(Behavior):", "    async def act(self): ..."]
    (tmp_path / "own_bell.py").write_text("\n".join(lines))
    monkeypatch.syspath_prepend(tmp_path)
    own = '<types><type name="bell" class="own_bell:Own" subsystem="mission_control"/>'
    text = MISSION.replace("</behaviors>", '<behavior type="bell" name="ring" priority="1"/></behaviors>')
    text = (
        text.replace("<types>", own) if "<types>" in text else text.replace("<resources>", f"{own}</types><resources>")
    )
    [fault] = faults_in(tmp_path, text)
    assert fault.message == "bell ring has no ARC, and needs one"
    assert 'kind="…"' in fault.remedy


class Misspelling(Bellringer):
    needs_arc = "driv"


def test_a_kind_of_arc_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    own = f'<types><type name="bell" class="{__name__}:Misspelling" subsystem="mission_control"/></types><resources>'
    node = f'<behavior type="bell" name="ring" priority="1">{ARC}</behavior></behaviors>'
    text = MISSION.replace("<resources>", own).replace("</behaviors>", node)
    [fault] = faults_in(tmp_path, text)
    assert fault.message == ("the class of bell needs an ARC of kind 'driv', and there is none (did you mean 'drive'?)")


def test_a_class_of_ones_own_that_sees_needs_pictures_unless_it_says_otherwise() -> None:
    assert facts_of(f"{__name__}:Watcher").needs_arc == "capture"
    assert facts_of(f"{__name__}:LooksSometimes").needs_arc == ""


@pytest.mark.parametrize(
    ("behavior", "needed"),
    [(BusyIdler, ""), (ActsSometimes, ""), (AskingIdler, "any"), (SeeingIdler, "capture")],
    ids=lambda given: getattr(given, "__name__", given),
)
def test_a_class_that_needs_no_arc_passes_that_on_until_a_derived_class_sets_another_kind(
    behavior: type[Behavior[BehaviorParameters]], needed: str
) -> None:
    assert behavior.needs_arc == needed
