"""The glossary holds each term once, in order, with a class that exists where it says and a key that is spoken."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from backbone.keys import Conversation

TOP = Path(__file__).parents[2]
PAGE = TOP / "docs" / "reference" / "glossary.md"
ROWS = [row.strip("| \n").split(" | ") for row in PAGE.read_text().splitlines() if re.match(r"\| (?!term)[^|-]", row)]


def test_each_term_stands_once_and_in_order() -> None:
    terms = [row[0].lower() for row in ROWS]
    assert len(terms) >= 40
    assert terms == sorted(set(terms))


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_a_term_has_a_meaning_a_source_and_its_class_where_the_page_says(row: list[str]) -> None:
    _, meaning, source, named = row[:4]
    assert meaning.endswith(".")
    assert source
    link = re.fullmatch(r"\[`(\w+)`\]\((.+)\)(?: \|)?", named)
    assert link, named
    assert re.search(rf"^class {link[1]}\b", (PAGE.parent / link[2]).read_text(), re.MULTILINE)


def test_a_key_ends_with_a_conversation() -> None:
    spoken = {f"`…/{conversation.value}`" for conversation in Conversation} | {"`scout/MISSION/SUBSYSTEM/…`"}
    assert {row[4] for row in ROWS if len(row) > 4} <= spoken
