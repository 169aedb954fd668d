"""A dry run shows the mission's first minute before it starts."""

from __future__ import annotations

import json
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any

import msgspec
import pytest
from rich.console import Console
from typer.testing import CliRunner

from backbone.command_line.cli import app
from backbone.component_database.messages import ComponentType
from backbone.dependency_database.messages import Resource
from backbone.dry_run.run import dry_run, placements, requests
from backbone.dry_run.screen import bars, screen
from backbone.mission.behavior_nodes import ArcNeed, BehaviorNode
from backbone.mission.model import CoreServiceDescription, Host, LastBranchDescription, MissionDescription
from backbone.mission.reader import read_mission
from backbone.naming import Subsystem
from backbone.scheduling.requests import RcUse, Usage

MISSION_XML = Path(__file__).parents[3] / "mission.xml"


def mission(
    *behaviors: BehaviorNode, tags: tuple[str, ...] = (), robots: int = 2, **types: list[str]
) -> MissionDescription:
    """Return a mission with one radio, one video frequency, two robots and these behaviors.

    Args:
        tags: Of host ``a``; host ``b`` has none.
        types: Type → host tags its components need.
    """
    kinds = ["command_radio", "video_frequency", "scout"]

    def component_type(name: str, needs: list[str] | None = None) -> ComponentType:
        subsystem = Subsystem.MISSION_CONTROL if name == "watch" else Subsystem.RESOURCE_POOL
        roles = {kind: kind for kind in needs or []}
        return ComponentType(name, "some.module:Class", subsystem, tags=types.get(name, []), needs=roles)

    return MissionDescription(
        name="m",
        priority=10,
        hosts=(Host(name="a", address="127.0.0.1", tags=tags), Host(name="b", address="192.0.2.2")),
        core=(CoreServiceDescription(type="nameserver", host="a"),),
        types=(component_type("watch"), component_type("capture", kinds), *map(component_type, kinds)),
        resources=(
            Resource("radio", "command_radio", sharable=True),
            Resource("video", "video_frequency", connect_s=0.5),
            *(Resource(f"scout{number}", "scout") for number in (1, 2)),
        ),
        components=(),
        behaviors=behaviors,
        source="m.xml",
    )


def watch(name: str, priority: int = 1, *, robot: str = "", run_s: float = 5.0, **more: Any) -> BehaviorNode:
    arc = ArcNeed(
        kind="capture",
        wish={"scout": robot} if robot else {},
        minimum_runtime_s=run_s,
        period_s=0.1,
        packet_time_s=more.pop("packet_time_s", 0.01),
    )
    return BehaviorNode(type="watch", name=name, priority=priority, arc=arc, **more)


def test_components_spread_over_equal_hosts() -> None:
    placed = placements(mission(watch("left")))
    assert [one.name for one in placed] == ["radio", "video", "scout1", "scout2", "left", "left-capture"]
    assert [one.host for one in placed] == ["a", "b"] * 3


def test_a_component_goes_where_the_tags_are_and_is_told_why_not_elsewhere() -> None:
    placed = placements(mission(tags=("video",), video_frequency=["video"]))
    video = next(one for one in placed if one.name == "video")
    assert video.host == "a"
    assert "b: lacks video" in video.reasons


def test_a_component_no_host_can_take_goes_nowhere_and_its_requests_wait_visibly() -> None:
    dry = dry_run(mission(watch("left"), video_frequency=["video"]))
    video = next(one for one in dry.placed if one.name == "video")
    assert (video.host, dry.can_come_up) == ("", False)
    assert "a: lacks video; b: lacks video" in video.reasons[0]
    (left,) = dry.claimed
    assert left.never_runs
    assert left.why is not None
    assert "for video, not up" in left.why.lines[0]


def test_children_of_a_behavior_without_a_host_do_not_start() -> None:
    parent = watch("parent", children=(BehaviorNode(type="capture", name="child", priority=1),))
    dry = dry_run(mission(parent, watch=["gl"]))
    assert "child" not in [one.name for one in dry.placed]
    assert dry.claimed[0].refused == "parent has no host, so no ARC is asked for"


def test_two_behaviors_of_equal_priority_take_turns() -> None:
    dry = dry_run(mission(watch("left", robot="scout1"), watch("right", robot="scout2")), 60.0)
    assert dry.can_come_up
    assert [run.arc for run in dry.timetable.runs] == ["left-capture", "right-capture"] * 5 + ["left-capture"]
    assert dry.timetable.utilization()["video"] == pytest.approx(5.0 / 5.5, abs=0.01)
    left, right = dry.claimed
    assert (left.first_grant_s, right.first_grant_s) == (0.5, 6.0)
    assert (left.turns, right.turns) == (6, 5)
    assert right.worst_wait_s == pytest.approx(6.0)


def test_only_a_request_without_a_turn_is_explained() -> None:
    """Each explanation plays the schedule on: with 20 watchers this took most of the time of a dry run."""
    dry = dry_run(mission(watch("left", robot="scout1"), watch("right", robot="scout2")), 4.0)
    assert [claimed.turns for claimed in dry.claimed] == [1, 0]
    assert [claimed.why is not None for claimed in dry.claimed] == [False, True]


def test_a_lower_behavior_never_runs_and_the_higher_one_is_named() -> None:
    dry = dry_run(mission(watch("high", 2, robot="scout1"), watch("low", 1, robot="scout2")))
    high, low = dry.claimed
    assert not high.never_runs
    assert low.never_runs
    assert low.why is not None
    assert low.why.blockers == ["high-capture"]
    assert low.worst_wait_s == 60.0
    assert dry.can_come_up, "waiting for ever is allowed, if it is visible"


def test_priorities_count_by_place_in_the_tree() -> None:
    group = BehaviorNode(type="watch", name="group", priority=5, children=(watch("child", 1, robot="scout1"),))
    dry = dry_run(mission(watch("other", 4, robot="scout2"), group))
    other, child = dry.claimed
    assert (other.never_runs, child.never_runs) == (True, False)
    assert child.priority == "m:10/group:5/child:1"


def test_a_demand_no_radio_can_serve_is_refused_with_its_reason() -> None:
    dry = dry_run(mission(watch("greedy", packet_time_s=0.2)))
    assert not dry.can_come_up
    assert "scheduling.capacity" in dry.claimed[0].refused
    assert dry.timetable.runs == []


def test_hardware_that_does_not_exist_is_refused_with_its_reason() -> None:
    dry = dry_run(mission(watch("lost", robot="scout7")))
    assert "'scout7'" in dry.claimed[0].refused
    assert not dry.can_come_up


def test_two_claims_of_any_robot_get_two_robots() -> None:
    dry = dry_run(mission(watch("one"), watch("two")))
    assert {rcs for claimed in dry.claimed for rcs in claimed.rcs if rcs.startswith("scout")} == {"scout1", "scout2"}


def test_its_requests_are_those_the_arcs_of_the_mission_send() -> None:
    """The real ARC makes its request from what its behavior starts it with; both are the same."""
    from backbone.mission.behavior_nodes import walk
    from resource_pool.arc_client import PathNode, claim_parameters
    from resource_pool.arc_request import ArcParameters

    description = read_mission(MISSION_XML)
    nodes = [msgspec.convert(msgspec.to_builtins(behavior), BehaviorNode) for behavior in description.behaviors]
    claiming = [(path, node.arc) for path, node in walk(nodes, [(description.name, description.priority)]) if node.arc]
    asked = requests(description)
    assert len(asked) == len(claiming) == 2
    for request, (path, need) in zip(asked, claiming, strict=True):
        given = claim_parameters(
            f"mission_control/{path[-1][0]}",
            path=[PathNode(*step) for step in path],
            minimum_runtime_s=need.minimum_runtime_s,
            usage=Usage(need.period_s, need.packet_time_s, kind=need.kind),
            wish=need.wish,
        )
        parameters = msgspec.convert(given, ArcParameters)
        (alternative,) = request.alternatives
        assert (request.arc, request.owner) == (f"{path[-1][0]}-capture", parameters.owner)
        assert [(node.name, node.priority) for node in request.path] == parameters.path
        assert request.minimum_runtime_s == parameters.minimum_runtime_s
        assert alternative == {
            path[-1][0].removeprefix("watch-"): RcUse(),
            "radio": RcUse([Usage(need.period_s, need.packet_time_s, kind="capture")]),
            "video1": RcUse(),
            "grabber": RcUse(),
        }


def test_the_last_branch_is_tried_by_itself_and_must_find_what_it_needs() -> None:
    def ends_with(branch: BehaviorNode) -> MissionDescription:
        last = LastBranchDescription(behavior=branch, within_s=20.0)
        return msgspec.structs.replace(mission(watch("day", robot="scout1")), last=last)

    dry = dry_run(ends_with(watch("evening", robot="scout1")))
    assert [claimed.behavior for claimed in dry.claimed] == ["day"]
    assert dry.last is not None
    assert (dry.last_name, dry.last.timetable.end_s) == ("evening", 20.0)
    assert [(claimed.behavior, claimed.first_grant_s) for claimed in dry.last.claimed] == [("evening", 0.5)]
    assert dry.can_come_up
    assert not dry_run(ends_with(watch("evening", robot="scout7"))).can_come_up
    console = Console(width=180, file=StringIO())
    console.print(screen(dry))
    assert isinstance(console.file, StringIO)
    assert "last branch evening, which runs at the end: dry run, 20 s" in console.file.getvalue()


def test_bars_show_turns_switches_and_who_shares() -> None:
    dry = dry_run(mission(watch("left", robot="scout1"), watch("right", robot="scout2")), 60.0)
    seen = bars(dry, {"left-capture": "A", "right-capture": "B"})
    assert list(seen) == ["left-capture", "right-capture", "radio", "video", "scout1", "scout2"]
    assert seen["left-capture"].startswith("█████······█████")
    assert seen["video"][:12] == "AAAAA▒BBBBBA"
    assert set(seen["radio"]) <= {"1", "▒", "·"}
    assert {len(bar) for bar in seen.values()} == {60}


def test_the_screen_names_who_never_runs_and_what_would_change_it() -> None:
    console = Console(width=180, file=StringIO())
    console.print(screen(dry_run(mission(watch("high", 2, robot="scout1"), watch("low", 1, robot="scout2")))))
    assert isinstance(console.file, StringIO)
    text = console.file.getvalue()
    assert "low-capture never runs" in text
    assert "what would change it: high-capture releases" in text


@pytest.fixture
def check() -> Callable[..., Any]:
    return lambda *words: CliRunner().invoke(app, ["check", str(MISSION_XML), *map(str, words)])


def test_the_command_prints_the_first_minute_and_starts_nothing(check: Callable[..., Any]) -> None:
    done = check("--dry-run")
    assert done.exit_code == 0
    assert "every request gets its turn" in done.stdout
    assert "video1" in done.stdout


def test_the_command_writes_a_trace_that_ends_when_it_was_told(check: Callable[..., Any], tmp_path: Path) -> None:
    file = tmp_path / "trace.jsonl"
    assert check("--dry-run", "--for", 12, "--trace", file).exit_code == 0
    lines = [json.loads(line) for line in file.read_text().splitlines()]
    assert (lines[0]["ev"], lines[-1]) == ("meta", {"ev": "end", "t": 12.0})


def test_a_trace_that_cannot_be_written_is_told(check: Callable[..., Any], tmp_path: Path) -> None:
    assert check("--dry-run", "--trace", tmp_path / "no" / "such" / "folder").exit_code == 5


def test_a_trace_replaces_no_file(check: Callable[..., Any], tmp_path: Path) -> None:
    file = tmp_path / "mission.xml"
    file.write_text("notes")
    refused = check("--dry-run", "--trace", file)
    assert (refused.exit_code, file.read_text()) == (5, "notes")
    assert "has content (Name a new file" in refused.stderr


@pytest.mark.parametrize("words", [("--for", "5"), ("--trace", "x.jsonl"), ("--dry-run", "--for", "0")], ids=" ".join)
def test_wrong_options_are_wrong_usage(check: Callable[..., Any], words: tuple[str, ...]) -> None:
    assert check(*words).exit_code == 2


def test_a_mission_that_cannot_come_up_exits_with_3(tmp_path: Path) -> None:
    text = MISSION_XML.read_text()
    file = tmp_path / "mission.xml"
    watch = "mission_control.behaviors.watch_for_motion:WatchForMotion"
    own = f'<type name="watch_for_motion" class="{watch}" subsystem="mission_control" tags="gpu"/>'
    heavy = text.replace("  <resources>", f"  <types>{own}</types>\n  <resources>")
    assert heavy != text
    file.write_text(heavy)
    assert CliRunner().invoke(app, ["check", str(file), "--dry-run"]).exit_code == 3
