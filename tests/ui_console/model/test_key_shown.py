"""A list of keys has what the words ask for, and is bounded whatever they are."""

from __future__ import annotations

from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st

from ui_console.model.key_shown import MOST_LISTED, KeyOrder, key_list
from ui_console.model.key_table import KeyRow

texts = st.text("aBc/ 1*[(\\", max_size=6)
rows = st.lists(st.builds(KeyRow, texts, texts, texts, st.just(1.0), st.floats(0.0, 9.0)), max_size=150)


@settings(max_examples=share(100))
@given(rows, texts, st.sampled_from(KeyOrder))
def test_all_that_is_listed_has_the_words_and_all_that_has_them_is_counted(
    given_rows: list[KeyRow], words: str, order: KeyOrder
) -> None:
    found = key_list(given_rows, words, order, 0)
    wanted = words.lower().split()
    having = [row for row in given_rows if all(word in " ".join(row.id).lower() for word in wanted)]
    assert (found.matching, found.heard) == (len(having), len(given_rows))
    assert len(found.rows) == min(len(having), MOST_LISTED)
    if order is KeyOrder.KEY:
        assert list(found.rows) == having[:MOST_LISTED]
    else:
        assert [row.bytes_per_s for row in found.rows] == sorted((one.bytes_per_s for one in having), reverse=True)[
            :MOST_LISTED
        ]


def test_words_are_found_in_key_sender_and_schema() -> None:
    row = KeyRow("resource_pool/scout1/telemetry", "resource_pool/scout1", "ScoutTelemetry/1")
    for words in ("scout1 tele", "scouttelemetry", "POOL /1", ""):
        assert key_list([row], words, KeyOrder.KEY, 0).rows == [row]
    assert key_list([row], "scout2", KeyOrder.KEY, 3).dropped == 3
