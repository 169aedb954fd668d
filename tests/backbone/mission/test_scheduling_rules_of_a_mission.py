"""The rules of scheduling stand in the mission file, and everybody who plans goes by them."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from backbone.component.launch import Launch
from backbone.dry_run.run import dry_run
from backbone.launcher.core_launches import UpOptions, core_launches
from backbone.mission.class_facts import parameters_of
from backbone.mission.model import MissionDescription
from backbone.mission.reader import MissionInvalid, read_mission
from backbone.naming import Subsystem
from backbone.rc_manager.service import RcManagerParameters
from backbone.scheduling.rules import SchedulingRules, values_of

HERE = Path(__file__).parent
SMALL = HERE / "small.xml"
REFERENCE = HERE.parents[2] / "docs" / "reference" / "mission-file.md"
PLAIN = '<service type="rc_manager" host="base"/>'


def with_rules(tmp_path: Path, **rules: str) -> MissionDescription:
    parameters = "".join(f'<parameter name="{name}" value="{value}"/>' for name, value in rules.items())
    file = tmp_path / "m.xml"
    file.write_text(SMALL.read_text().replace(PLAIN, f"{PLAIN[:-2]}>{parameters}</service>"))
    return read_mission(file)


def launch_of_rc_manager(description: MissionDescription) -> Launch:
    own = Launch("small", Subsystem.BACKBONE, "launcher", "launcher", "", "base", "", 0.0, 1.0, {})
    launches = core_launches(description, own, UpOptions())
    return next(launch for launch in launches if launch.name == "rc_manager")


def test_the_rc_manager_starts_with_the_rules_of_the_file(tmp_path: Path) -> None:
    rules = {"policy": "strict", "discipline": "time", "admission": "sum"}
    times = {"aging_s": "30", "grid_s": "0.5", "grace_s": "0"}
    launch = launch_of_rc_manager(with_rules(tmp_path, **rules, **times))
    assert msgspec.convert(launch.parameters, RcManagerParameters) == RcManagerParameters(
        mission="small",
        mission_priority=10,
        policy="strict",
        discipline="time",
        admission="sum",
        aging_s=30.0,
        grid_s=0.5,
        grace_s=0.0,
    )


def test_without_any_the_rules_are_the_defaults() -> None:
    launch = launch_of_rc_manager(read_mission(SMALL))
    expected = RcManagerParameters(mission="small", mission_priority=10)
    assert msgspec.convert(launch.parameters, RcManagerParameters) == expected


@pytest.mark.parametrize("rule", ["policy", "discipline", "admission"])
def test_every_word_a_rule_may_be_is_accepted(tmp_path: Path, rule: str) -> None:
    for word in values_of(rule):
        assert with_rules(tmp_path, **{rule: word}).core_parameters("rc_manager") == {rule: word}


def test_a_dry_run_goes_by_the_rules_of_the_file(tmp_path: Path) -> None:
    plain = dry_run(read_mission(SMALL), 20.0)
    ruled = dry_run(with_rules(tmp_path, policy="strict", discipline="time", grid_s="3", grace_s="0.1"), 20.0)
    assert (plain.trace[0]["mode"], plain.trace[0]["discipline"], plain.trace[0]["grace"]) == ("no_delay", "turns", 0.2)
    assert (ruled.trace[0]["mode"], ruled.trace[0]["discipline"], ruled.trace[0]["grace"]) == ("strict", "time", 0.1)
    assert not [line for line in plain.trace if line["ev"] == "extend"]
    ends = [line["until"] for line in ruled.trace if line["ev"] == "extend"]
    assert ends
    assert all(end_s % 3.0 == pytest.approx(0.0) for end_s in ends)


def test_the_reference_tells_every_rule_with_its_default_and_meaning() -> None:
    told = REFERENCE.read_text()
    meanings = {one.name: one.doc for one in parameters_of(SchedulingRules)}
    for rule in msgspec.structs.fields(SchedulingRules):
        assert meanings[rule.name]
        default = f"{rule.default:g}" if isinstance(rule.default, float) else rule.default
        shown = f"`{default}`" if default else "–"
        assert f"| `{rule.name}` | {shown} | {meanings[rule.name]}; " in told


@pytest.mark.parametrize(
    ("planner", "message"),
    [
        ("nonsense", "planner='nonsense' is illegal"),
        ("no.module:Planner", "no.module:Planner: no module no (Correct the name, or put its folder on PYTHONPATH)"),
        ("backbone.scheduling.rules:SchedulingRules", "is no planner: it lacks before, due"),
        ("backbone.scheduling.whole_group:WholePlanner", "(did you mean 'WholeGroupPlanner'?)"),
    ],
)
def test_what_is_no_planner_here_is_a_fault_with_its_place(tmp_path: Path, planner: str, message: str) -> None:
    with pytest.raises(MissionInvalid) as invalid:
        with_rules(tmp_path, planner=planner)
    (fault,) = invalid.value.faults
    assert message in str(fault)
    assert fault.line == 12


def test_aging_before_a_hand_over_can_end_is_refused(tmp_path: Path) -> None:
    """ARCs that rise every millisecond override each other before a grant, and none gets a turn."""
    with pytest.raises(MissionInvalid) as invalid:
        with_rules(tmp_path, aging_s="0.001")
    (fault,) = invalid.value.faults
    assert "aging_s is 0.001; it must be 0 (never) or at least 1" in str(fault)
    assert fault.line == 12
    assert with_rules(tmp_path, aging_s="1").core_parameters("rc_manager") == {"aging_s": 1}


def test_aging_before_the_slowest_resource_is_handed_over_is_refused(tmp_path: Path) -> None:
    """With 60 s to connect, two ARCs that rise every second never got a turn."""
    slow = SMALL.read_text().replace('connect-s="0.3"', 'connect-s="2.5" disconnect-s="0.5"')
    file = tmp_path / "m.xml"
    aging = '<parameter name="aging_s" value="{}"/>'
    text = slow.replace(PLAIN, f"{PLAIN[:-2]}>{aging}</service>")
    file.write_text(text.format(1))
    with pytest.raises(MissionInvalid) as invalid:
        read_mission(file)
    (fault,) = invalid.value.faults
    assert "aging_s is 1, and video1 needs 3 s to disconnect and connect" in fault.message
    assert fault.remedy == "Write at least 3, or 0 (never)"
    assert text.format(1).splitlines()[fault.line - 1][fault.column - 1 :].startswith("value=")
    for legal in (0, 3):
        file.write_text(text.format(legal))
        read_mission(file)
