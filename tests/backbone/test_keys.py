"""Keys are spelt in one place, and nothing that would change their meaning gets into them."""

from __future__ import annotations

import pytest
import zenoh
from hypothesis import given
from hypothesis import strategies as st

from backbone.incarnation import Incarnation
from backbone.keys import Conversation, address_of, key
from backbone.naming import IllegalName, Subsystem, address, claim_address

names = st.from_regex(r"[a-z][a-z0-9_-]{0,62}", fullmatch=True)


@given(names, st.sampled_from(Subsystem), names, st.sampled_from(Conversation))
def test_the_address_is_read_back_from_a_key(
    mission: str, subsystem: Subsystem, name: str, conversation: Conversation
) -> None:
    where = address(subsystem, name)
    assert address_of(key(mission, where, conversation)) == where
    assert zenoh.KeyExpr(key(mission, where, conversation))


@given(names, names, st.integers(1, 2**22), st.integers(0, 2**48 - 1))
def test_the_address_of_a_claim_is_read_back_too(name: str, host: str, pid: int, start: int) -> None:
    claim = claim_address(address(Subsystem.BACKBONE, name), Incarnation(host, pid, start))
    assert address_of(key("m", claim, Conversation.ALIVE)) == claim


@given(st.text(max_size=12), st.text(max_size=12))
def test_what_passes_is_a_key_expression_of_four_segments_and_more(mission: str, name: str) -> None:
    try:
        spelt = key(mission, f"backbone/{name}", Conversation.ASK)
    except IllegalName:
        return
    assert str(zenoh.KeyExpr(spelt)) == spelt
    assert "**" not in spelt


@pytest.mark.parametrize(
    "bad", ["", "backbone/", "/x", "a//b", "a/**", "a/b*", "a/#", "a/$*", "a/b?x=1", "a/@verbatim"]
)
def test_addresses_that_would_change_the_key_are_refused(bad: str) -> None:
    with pytest.raises(IllegalName):
        key("m", bad, Conversation.ASK)


def test_a_star_stands_for_one_segment() -> None:
    assert key("m", "resource_pool/*", Conversation.STATUS) == "scout/m/resource_pool/*/status"
