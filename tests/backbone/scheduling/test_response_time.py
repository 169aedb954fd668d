from __future__ import annotations

from examples import share
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from trace_checker import admissible as independently_admissible
from trace_checker.admission import Stream as CheckedStream

from backbone.scheduling.requests import Usage
from backbone.scheduling.response_time import admissible, worst_response_us
from backbone.scheduling.streams import Stream, stream, utilization


@st.composite
def small_sets(draw: st.DrawFn) -> list[Stream]:
    """Streams with times of a few ticks, so that every moment of their worst case can be played."""
    found = []
    for _ in range(draw(st.integers(1, 4))):
        period = draw(st.integers(2, 12))
        packet = draw(st.integers(1, max(1, period // 2)))
        found.append(Stream(period, packet, draw(st.integers(packet, 2 * period)), draw(st.integers(0, 3))))
    return found


def worst_by_playing(streams: list[Stream], place: int) -> int:
    """Play the worst case tick by tick and return the longest response of the stream.

    The longest lower packet began one tick ago; all higher ones and the stream itself are released now,
    as late as their jitter allows, and from then on as early as possible.
    """
    lower = max((one.packet_us for one in streams[place + 1 :]), default=1)
    now, worst = lower - 1, 0
    sent = [0] * (place + 1)

    def arrival(which: int) -> int:
        return max(0, sent[which] * streams[which].period_us - streams[which].jitter_us)

    while ready := [which for which in range(place + 1) if arrival(which) <= now]:
        first = ready[0]
        now += streams[first].packet_us
        if first == place:
            release = sent[place] * streams[place].period_us - streams[place].jitter_us
            worst = max(worst, now - release)
        sent[first] += 1
    return worst


@settings(max_examples=share(300))
@given(small_sets())
def test_worst_response_is_exactly_what_playing_the_worst_case_shows(streams):
    assume(utilization(streams) < 0.99)
    for place in range(len(streams)):
        assert worst_response_us(streams, place) == worst_by_playing(streams, place)


@settings(max_examples=share(300))
@given(small_sets(), st.sampled_from([0.5, 0.8, 1.0]))
def test_an_independent_analysis_admits_the_same_sets(streams, capacity):
    assert admissible(streams, capacity) == independently_admissible([CheckedStream(*one) for one in streams], capacity)


@settings(max_examples=share(100))
@given(small_sets())
def test_what_the_exact_test_admits_the_sum_admits_too(streams):
    if admissible(streams, 1.0):
        assert admissible(streams, 1.0, "sum")


def test_the_second_packet_of_a_busy_period_can_be_the_late_one():
    """The example of Davis et al. 2007: the first packet's response is 3.0 ms, the second's 3.5 ms."""
    streams = [Stream(2500, 1000, 2500, 0), Stream(3500, 1000, 3250, 0), Stream(3500, 1000, 3250, 0)]
    assert worst_response_us(streams, 2) == 3500
    assert not admissible(streams, 1.0)
    assert admissible(streams, 1.0, "sum")


def test_shares_that_add_up_to_the_capacity_fit():
    assert admissible([stream(Usage(0.1, 0.01))] * 3, 0.3)
    assert not admissible([stream(Usage(0.1, 0.01))] * 4, 0.3)


def test_a_full_radio_with_a_lower_packet_in_the_way_has_no_bound():
    streams = [Stream(10, 5, 10, 0), Stream(10, 5, 10, 0), Stream(10, 2, 10, 0)]
    assert worst_response_us(streams, 1) is None
    assert not admissible(streams[:2], 0.9)
