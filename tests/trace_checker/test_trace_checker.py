"""Reading, priorities, admission and the command line of the checker."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from trace_checker import Malformed, admissible, check, read_lines
from trace_checker.__main__ import main
from trace_checker.admission import Stream, stream_of
from trace_checker.priority_order import NodeTree, connected, higher, ranked
from trace_checker.test_each_violation import A, B, V, line, meta, starts
from trace_checker.trace_format import Line, require_sound


@pytest.mark.parametrize(
    "line",
    [
        {},
        {"ev": "jump", "t": 0},
        {"ev": "end"},
        {"ev": "connect", "t": 0},
        {"ev": "connect", "t": 0, "arc": 3},
        {**meta(), "mode": "eager"},
        {**A, "use": {"v": "y"}},
        {**A, "use": {"v": [{"period": 0.1, "cost": 0}]}},
        {**A, "owner": {"id": "console"}},
    ],
)
def test_lines_that_the_format_does_not_have_are_refused(line: dict[str, object]) -> None:
    with pytest.raises(Malformed):
        require_sound(line)


def test_a_file_with_a_broken_line_is_refused_with_its_number(tmp_path: Path) -> None:
    file = tmp_path / "trace.jsonl"
    file.write_text(json.dumps(meta()) + "\n\n{]\n")
    with pytest.raises(Malformed, match="line 3"):
        list(read_lines(file))


def test_the_command_line_lists_violations_and_says_with_its_exit_code_if_there_are_any(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "trace.jsonl"
    late = [meta(), V, A, *starts(1, "a")]
    file.write_text("".join(json.dumps(line) + "\n" for line in late))
    assert main([str(file)]) == 1
    assert "WC" in capsys.readouterr().out
    assert main([str(file), "--tol", "2"]) == 0
    assert "5 lines, 0 violation(s)" in capsys.readouterr().out
    assert main([str(tmp_path / "none.jsonl")]) == 1


def test_higher_compares_siblings_where_two_paths_part() -> None:
    tree = NodeTree()
    for name, parent, number in [("m", None, 0), ("a", "m", 2), ("b", "m", 1), ("a1", "a", 0), ("b9", "b", 9)]:
        tree.put(name, parent, number)
    tree.put("console c", None, 0)
    assert higher(tree.path("a1"), tree.path("b9"))
    assert not higher(tree.path("b9"), tree.path("a1"))
    assert higher(tree.path("a"), tree.path("a1"))
    assert not higher(tree.path("a"), tree.path("a"))
    assert not higher(tree.path("console c"), tree.path("a1"))
    assert not higher(tree.path("a1"), tree.path("console c"))


def test_the_order_takes_the_oldest_that_no_remaining_one_is_above() -> None:
    above = {("c", "a")}
    assert ranked("abc", lambda one, other: (one, other) in above, "abc".index) == ["b", "c", "a"]


def test_groups_are_connected_through_others() -> None:
    uses = {"a": "u", "b": "uv", "c": "v", "d": "w"}
    assert sorted(map(sorted, connected(list(uses), lambda arc: uses[arc]))) == [["a", "b", "c"], ["d"]]


def test_the_second_packet_of_a_busy_period_can_be_the_late_one() -> None:
    """The example of Davis et al. 2007."""
    streams = [Stream(2500, 1000, 2500, 0), Stream(3500, 1000, 3250, 0), Stream(3500, 1000, 3250, 0)]
    assert not admissible(streams, 1.0)
    assert admissible([*streams[:2], streams[2]._replace(deadline=3500)], 1.0)


def test_a_packet_that_is_being_sent_delays_a_higher_one_by_all_but_one_tick() -> None:
    high, low = Stream(100, 20, 69, 0), Stream(100, 50, 100, 0)
    assert admissible([high, low], 1.0)
    assert not admissible([high._replace(deadline=68), low], 1.0)
    assert not admissible([high._replace(jitter=1), low], 1.0)


def test_shares_that_add_up_to_the_capacity_fit() -> None:
    stream = stream_of({"period": 0.1, "cost": 0.01})
    assert admissible([stream] * 3, 0.3)
    assert not admissible([stream] * 4, 0.3)


KILLED = [meta(), V, A, *starts(0, "a", v=1)]
"""A life of an RC manager that was killed while ``a`` had its RC."""


@pytest.mark.parametrize(
    ("second", "found"),
    [
        ([B, *starts(3, "b", v=2), line("end", 4)], []),
        ([B, *starts(3, "b", v=2), A, *starts(3.5, "a", v=3), line("end", 4)], ["EXCL"]),
    ],
)
def test_each_life_of_the_rc_manager_is_judged_by_itself(second: list[Line], found: list[str]) -> None:
    """Its successor collects requests and holders anew, and writes them down anew, behind a ``meta`` of its own."""
    life = [{**one, "t": max(one["t"], 3.0)} for one in (meta(), V, *second)]
    assert [one.code for one in check([*KILLED, *life])] == found


def test_a_meta_that_only_relaxes_the_plan_begins_no_life() -> None:
    relaxed = {**meta(), "t": 1.0, "wc": "relaxed"}
    again = line("grant", 2, arc="a", epoch={"v": 2})
    assert [one.code for one in check([*KILLED, relaxed, again])] == ["FORM"]
