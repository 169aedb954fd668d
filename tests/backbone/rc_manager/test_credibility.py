"""An RC that says what cannot be is put aside alone, with the reason; it comes back once it makes sense."""

from __future__ import annotations

import itertools
import json
import math
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace
from rc_manager_at_work import Pool, a_pool, request

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import run_virtual
from backbone.dependency_database.messages import Resource
from backbone.keys import Conversation
from backbone.rc_manager.credibility import contradiction
from backbone.rc_manager.messages import LONGEST_PACKET_S, AskWhy, RcState, most_epoch
from backbone.scheduling.requests import Holder, MeasuredPackets, RequestState, Scheduled
from backbone.scheduling.views import Why
from backbone.wire import MalformedMessage

VIDEO = Resource("video", "video_frequency")
RADIO = Resource("radio", "command_radio", sharable=True)
NOW_S = 100.0
HOLDER = Holder("one", 7, 90.0, 102.0)
SLOW = MeasuredPackets("one", "drive", 0.0043)
FREE = RcState("video", "video_frequency", False, 1.0, [], 7, 0, 0)
NONSENSE = {
    "another name": replace(FREE, name="radio"),
    "capacity of nan": replace(FREE, capacity=math.nan),
    "capacity above 1": replace(FREE, capacity=1.5),
    "capacity below 0": replace(FREE, capacity=-0.1),
    "an epoch of 64 bits": replace(FREE, last_epoch=2**64 - 1),
    "an epoch of tomorrow": replace(FREE, last_epoch=2 * most_epoch(NOW_S) + 1),
    "an epoch below 0": replace(FREE, last_epoch=-1),
    "two holders": replace(FREE, holders=[HOLDER, replace(HOLDER, arc="two")]),
    "a holder after its last epoch": replace(FREE, holders=[replace(HOLDER, epoch=8)]),
    "a holder never granted": replace(FREE, last_epoch=9, holders=[replace(HOLDER, epoch=8)]),
    "a lease of 1e9 s": replace(FREE, holders=[replace(HOLDER, lease_until_s=1e9)]),
    "a lease of nan": replace(FREE, holders=[replace(HOLDER, lease_until_s=math.nan)]),
    "packets, and not sharable": replace(FREE, holders=[HOLDER], measured=[SLOW]),
}
SENDS = replace(FREE, name="radio", holders=[HOLDER], measured=[SLOW])
NONSENSE_OF_PACKETS = {
    "packets of a stranger": replace(SENDS, measured=[replace(SLOW, arc="two")]),
    "one kind of packets twice": replace(SENDS, measured=[SLOW, replace(SLOW, packet_time_s=0.005)]),
    **{
        f"packets of {takes_s} s": replace(SENDS, measured=[replace(SLOW, packet_time_s=takes_s)])
        for takes_s in (0.0, -0.001, LONGEST_PACKET_S * 1.001, math.nan, math.inf)
    },
}


@pytest.mark.parametrize("state", NONSENSE.values(), ids=NONSENSE)
def test_what_cannot_be_is_named(state: RcState) -> None:
    assert contradiction(state, VIDEO, NOW_S, given=7)


@pytest.mark.parametrize("state", NONSENSE_OF_PACKETS.values(), ids=NONSENSE_OF_PACKETS)
def test_packets_that_cannot_be_are_named(state: RcState) -> None:
    assert "packet" in contradiction(state, RADIO, NOW_S, given=7)


def test_packets_that_can_be_are_believed() -> None:
    other = replace(SLOW, kind="transmitter", packet_time_s=LONGEST_PACKET_S)
    assert contradiction(replace(SENDS, measured=[SLOW, other]), RADIO, NOW_S, given=7) == ""


def test_what_can_be_is_believed() -> None:
    assert contradiction(FREE, VIDEO, NOW_S, given=7) == ""
    assert contradiction(replace(FREE, holders=[HOLDER]), VIDEO, NOW_S, given=7) == ""
    assert contradiction(replace(FREE, last_epoch=most_epoch(NOW_S)), VIDEO, NOW_S) == ""
    later = replace(FREE, name="radio", holders=[HOLDER, replace(HOLDER, arc="two", epoch=6)])
    assert contradiction(later, RADIO, NOW_S, given=7) == ""
    twice = replace(FREE, name="radio", holders=[HOLDER, HOLDER])
    assert "2 times" in contradiction(twice, RADIO, NOW_S, given=7)


def test_an_rc_that_talks_nonsense_is_put_aside_alone_and_comes_back(
    local_mission: Any, beside: Any, tmp_path: Path
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, beside, tmp_path / "trace.jsonl") as here, here.beside(here.manager()):
            one, two, three = await here.arc("one"), await here.arc("two"), await here.arc("three")
            await one.ask_for(request("one", "left", "video"))
            await two.ask_for(request("two", "right", "radio"))
            await here.clock.sleep_s(1.0)
            assert one.is_open
            assert two.is_open
            tell(here, "video", lambda state: replace(state, last_epoch=2**64 - 1))
            await here.clock.sleep_s(1.0)
            assert not one.is_open
            assert two.is_open
            reasons = await why(here, "video")
            assert reasons.state == "down"
            assert f"put aside: it reports epoch {2**64 - 1}" in reasons.lines[0]
            assert "put aside" in (await why(here, "one")).lines[0]
            waits: Scheduled = await three.ask_for(request("three", "video"))
            assert waits.state is RequestState.WAITING
            await here.clock.sleep_s(3.0)  # it is asked again, and talks nonsense still
            assert not one.is_open
            here.rcs["video"].tells = lambda state: state
            await here.clock.sleep_s(3.0)
            assert one.is_open
            assert two.is_open
            assert (await why(here, "video")).state == "held"
        trace = (tmp_path / "trace.jsonl").read_text().splitlines()
        states = [line for line in trace if '"rc_state"' in line]
        assert ["down" in state for state in states] == [True, False]

    run_virtual(main())


def test_a_stranger_who_publishes_nonsense_in_the_name_of_an_rc_changes_nothing(
    local_mission: Any, beside: Any, tmp_path: Path
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, beside, tmp_path / "trace.jsonl") as here, here.beside(here.manager()):
            one = await here.arc("one")
            await one.ask_for(request("one", "left", "video"))
            await here.clock.sleep_s(1.0)
            stranger = here.network.join("resource_pool/video", here.clock)
            for state in NONSENSE.values():
                stranger.publish("resource_pool/video", Conversation.TELEMETRY, replace(state, last_epoch=10**12))
            stranger.publish("resource_pool/video", Conversation.TELEMETRY, replace(FREE, name="no-such-rc"))
            await here.clock.sleep_s(1.0)
            assert one.is_open
            assert [at_s for what, _, at_s in one.log if what == "rc"] == []
            await stranger.close()

    run_virtual(main())


def test_an_rc_manager_that_starts_beside_an_rc_that_talks_nonsense_serves_the_others(
    local_mission: Any, beside: Any, tmp_path: Path
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, beside, tmp_path / "trace.jsonl") as here:
            here.rcs["video"].tells = lambda state: replace(state, holders=[Holder("ghost", 2**60, 0.0, 1e9)])
            here.rcs["left"].tells = unreadable
            async with here.beside(here.manager()):
                one, two = await here.arc("one"), await here.arc("two")
                await one.ask_for(request("one", "left", "video"))
                await two.ask_for(request("two", "right", "radio"))
                await here.clock.sleep_s(2.0)
                assert two.is_open
                assert not one.is_open
                assert "ghost" in (await why(here, "video")).lines[0]
                assert "cannot be read" in (await why(here, "left")).lines[0]
                here.rcs["video"].tells = here.rcs["left"].tells = lambda state: state
                await here.clock.sleep_s(2.0)
                assert one.is_open

    run_virtual(main())


def test_a_trace_that_goes_on_after_a_restart_says_that_an_rc_is_up_again(
    local_mission: Any, beside: Any, tmp_path: Path
) -> None:
    """By the lines of the first RC manager the frequency is down; the second one grants it."""

    async def main() -> None:
        async with a_pool(local_mission, beside, tmp_path / "trace.jsonl") as here:
            one = await here.arc("one")
            async with here.beside(here.manager()):
                await one.ask_for(request("one", "left", "video"))
                await here.clock.sleep_s(1.0)
                tell(here, "video", lambda state: replace(state, last_epoch=2**64 - 1))
                await here.clock.sleep_s(1.0)
                assert states_of(tmp_path, "video") == ["down"]
            here.rcs["video"].tells = lambda state: state
            async with here.beside(here.manager()):
                await here.clock.sleep_s(3.0)
                assert one.is_open
                assert states_of(tmp_path, "video")[-1] == "up"

    run_virtual(main())


def states_of(folder: Path, rc: str) -> list[str]:
    lines = map(json.loads, (folder / "trace.jsonl").read_text().splitlines())
    return [line["state"] for line in lines if line["ev"] == "rc_state" and line["id"] == rc]


def unreadable(_state: RcState) -> RcState:
    raise MalformedMessage("RcState/1: Expected `int` <= 9007199254740992")


def tell(here: Pool, rc: str, lie: Any) -> None:
    """Let the RC say this from now on, and publish it."""
    liar = here.rcs[rc]
    liar.tells = lie
    liar.bus.publish(liar.address, Conversation.TELEMETRY, lie(FREE))


async def why(here: Pool, name: str) -> Why:
    asker = here.network.join("ui_console/asker", here.clock)
    reasons = await asker.ask(RC_MANAGER, AskWhy(name), Why, within_s=1)
    await asker.close()
    return reasons


def test_an_rc_whose_nonsense_differs_each_time_is_reported_once(
    local_mission: Any, beside: Any, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, beside, tmp_path / "trace.jsonl") as here, here.beside(here.manager()):
            epochs = itertools.count(2**61)
            tell(here, "video", lambda state: replace(state, last_epoch=next(epochs)))
            await here.clock.sleep_s(5.0)
            latest = next(epochs) - 1
            assert f"it reports epoch {latest}" in (await why(here, "video")).lines[0]

    run_virtual(main())
    assert len([line for line in caplog.messages if "is put aside" in line]) == 1
