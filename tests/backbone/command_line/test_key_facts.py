"""Facts of keys: counts of all are added up, a silent key with a count has a row, and nonsense is left out."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.command_line.key_facts import KeyFacts, facts_text, with_facts
from backbone.command_line.message_lines import TrafficTable, traffic_lines
from backbone.component.messages import DEADLINES_MISSED, MESSAGES_DROPPED
from backbone.quality import OutputQuality, Urgency

KEYS = ["x/a/frames", "x/*/status", "m/vision/ball/outputs", "x/a/nonsense"]
counts = st.dictionaries(st.sampled_from(KEYS), st.integers(1, 1000))


@given(st.lists(st.tuples(counts, counts)), st.sets(st.sampled_from(KEYS)))
def test_counts_of_all_listeners_are_added_up_and_none_is_hidden(
    told: list[tuple[dict[str, int], dict[str, int]]], heard: set[str]
) -> None:
    facts, table = KeyFacts(), TrafficTable()
    for dropped, missed in told:
        named = {f"{MESSAGES_DROPPED}{key}": float(count) for key, count in dropped.items()}
        facts.take_statistics(named | {f"{DEADLINES_MISSED}{key}": float(count) for key, count in missed.items()})
        facts.take_statistics({"rate_hz": 3.0, "overwritten_ball": 7.0})
    for key in sorted(heard):
        table.add(f"scout/night/{key}", "x/a", "Note/1", 10)
    rows = with_facts(table.busiest(1.0), facts, "night")
    assert [row["key"] for row in rows] == list(dict.fromkeys(row["key"] for row in rows))
    assert {row["key"].split("/", 2)[2] for row in rows} == heard | {
        key for one in told for part in one for key in part
    }
    for name, index in (("dropped", 0), ("deadlines_missed", 1)):
        assert sum(row[name] for row in rows) == sum(count for one in told for count in one[index].values())
    assert len(traffic_lines(rows)) == len(rows)


def test_a_row_says_the_quality_that_a_unit_declared() -> None:
    facts, table = KeyFacts(), TrafficTable()
    urgent: dict[str, Any] = {"reliable": True, "urgency": "urgent"}
    facts.take_unit("m/vision", {"published": ["ball"], "qualities": {"ball": urgent, "other": urgent}})
    assert facts.declared["m/vision/ball/outputs"].urgency is Urgency.URGENT
    for key in ("m/vision/ball/outputs", "m/vision/other/outputs", "x/a/nonsense"):
        table.add(f"scout/night/{key}", "m/vision", "Note/1", 10)
    told = {row["key"]: facts_text(row) for row in with_facts(table.busiest(1.0), facts, "night")}
    assert list(told.values()) == ["reliable, urgent", str(OutputQuality().quality), ""]


def test_a_row_says_no_quality_if_the_unit_that_may_declare_another_is_silent() -> None:
    facts, table = KeyFacts(silent=["m/vision", "x/a"]), TrafficTable()
    for key in ("m/vision/ball/outputs", "x/a/frames"):
        table.add(f"scout/night/{key}", "m/vision", "Note/1", 10)
    told = {row["key"]: facts_text(row) for row in with_facts(table.busiest(1.0), facts, "night")}
    assert list(told.values()) == ["", "best effort, low"]


@pytest.mark.parametrize("nonsense", [{"published": 3}, {"published": ["a"], "qualities": {"a": {"reliable": 2}}}, {}])
def test_a_unit_of_another_release_changes_nothing(nonsense: dict[str, object]) -> None:
    facts = KeyFacts()
    facts.take_unit("m/vision", nonsense)
    assert facts == KeyFacts()


def test_only_keys_that_are_meant_get_a_row() -> None:
    facts = KeyFacts(dropped={"x/a/frames": 3, "x/b/frames": 4})
    assert [row["key"] for row in with_facts([], facts, "night", ("x/b/*",))] == ["scout/night/x/b/frames"]
