"""Qualities: each conversation has one, within the limits of messages."""

from hypothesis import given
from hypothesis import strategies as st

from backbone.keys import Conversation
from backbone.quality import LARGE, NEVER_DROPPED, QUALITY, OutputQuality, Urgency
from backbone.wire import MAX_LARGE_MESSAGE_BYTES, MAX_MESSAGE_BYTES


def test_each_conversation_has_a_quality() -> None:
    assert set(QUALITY) == set(Conversation)


def test_what_is_large_is_repeated() -> None:
    assert not LARGE & NEVER_DROPPED


@given(st.integers(1, MAX_LARGE_MESSAGE_BYTES), st.booleans(), st.sampled_from(Urgency), st.booleans())
def test_an_outputs_limit_holds_on_its_host_and_as_far_as_the_network_admits_there(
    most: int, reliable: bool, urgency: Urgency, express: bool
) -> None:
    quality = OutputQuality(most_bytes=most, reliable=reliable, urgency=urgency, express=express).quality
    assert (quality.most_bytes_on_host, quality.most_bytes) == (most, min(most, MAX_MESSAGE_BYTES))
    assert str(quality) == f"{'reliable' if reliable else 'best effort'}, {urgency}{', express' * express}"
