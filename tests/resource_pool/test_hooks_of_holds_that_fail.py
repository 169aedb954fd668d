"""A hook of a hold that hangs or fails leaves its resource safe, and holds up no other hold of the RC."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

import pytest
from pool_on_local_network import Pool, a_pool

from backbone.bus.clock import run_virtual
from backbone.bus.interface import Reply
from backbone.component.messages import LogLevel
from backbone.errors import NoResponder, OutcomeUnknown, Refusal, ReplyTimeout
from backbone.rc_manager.messages import Connect, Connected, Disconnect, Disconnected, StaleEpoch
from backbone.scheduling.requests import RcUse
from backbone.wire import Message
from resource_pool.commands import Command
from resource_pool.drivers.interface import HardwareFault
from resource_pool.hold_ends import ANSWERS_WITHIN_S
from resource_pool.holds import Hold
from resource_pool.messages import Applied
from resource_pool.rcs.skeleton import Lamp, Shine
from resource_pool.resource_controller import RcParameters, ResourceController

LEASE_S = 2.0


class Shared(ResourceController[RcParameters]):
    """A sharable RC whose hooks fail for the ARCs that the test names."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self.connecting: dict[str, BaseException | None] = {}
        self.ending: dict[str, BaseException] = {}
        self.diary: list[str] = []

    async def connected(self, hold: Hold) -> None:
        self.diary.append(f"on for {hold.arc}")
        if hold.arc in self.connecting:
            if (error := self.connecting[hold.arc]) is not None:
                raise error
            await asyncio.Event().wait()

    async def make_safe(self, hold: Hold) -> None:
        self.diary.append(f"off for {hold.arc}")
        if hold.arc in self.ending:
            raise self.ending[hold.arc]


async def _shared(pool: Pool) -> Shared:
    return await pool.start(Shared, "lights", {"sharable": True})


async def _order(pool: Pool, order: Message, reply: type[Reply]) -> Reply:
    return await pool.manager_voice.ask("resource_pool/lights", order, reply, within_s=0.5)


async def _connect(pool: Pool, *arcs: str) -> None:
    for epoch, arc in enumerate(arcs, start=1):
        await _order(pool, Connect(arc, epoch, LEASE_S, RcUse(), {}), Connected)


@pytest.mark.parametrize(
    ("error", "refusal", "detail"),
    [
        (None, HardwareFault, "lights could not be connected to two: nothing within 0.4 s"),
        (HardwareFault("lamp 2 is dark"), HardwareFault, "lamp 2 is dark"),
        (ReplyTimeout("no dimmer"), OutcomeUnknown, "no dimmer"),
    ],
    ids=["hangs", "fault", "link"],
)
def test_a_connection_that_fails_is_made_safe_and_holds_up_no_other_hold(
    local_mission: Any, error: Exception | None, refusal: type[Refusal], detail: str
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            rc = await _shared(pool)
            rc.connecting["two"] = error
            with pytest.raises(refusal, match=detail):
                await _connect(pool, "one", "two")
            assert rc.diary == ["on for one", "on for two", "off for two"]
            assert rc.feedback == "held by one"
            assert "could not be connected" in rc.story.of("two")[-1].what
            await pool.clock.sleep_s(LEASE_S)
            assert rc.diary[-1] == "off for one", "its lease has ended"

    run_virtual(main())


@pytest.mark.parametrize("error", [ReplyTimeout("no dimmer"), StaleEpoch("no dimmer for epoch 1")], ids=repr)
def test_a_safe_state_that_another_component_refused_is_an_alarm_and_tried_again(
    local_mission: Any, error: Exception
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            rc = await _shared(pool)
            rc.ending["one"] = error
            await _connect(pool, "one", "two")
            with pytest.raises(HardwareFault, match="lights is not safe after one"):
                await _order(pool, Disconnect("one", 1), Disconnected)
            assert rc.feedback == "held by two, not safe after one"
            assert rc.story.of("one")[-1].level is LogLevel.ALARM
            del rc.ending["one"]
            await _order(pool, Connect("three", 3, LEASE_S, RcUse(), {}), Connected)
            assert rc.feedback == "held by three, two"

    run_virtual(main())


@pytest.mark.parametrize("error", [ReplyTimeout("no dimmer"), ValueError("no lamp 1")], ids=repr)
@pytest.mark.parametrize("is_ended", [True, False])
def test_all_other_holds_are_made_safe_when_one_is_not(local_mission: Any, error: Exception, is_ended: bool) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            rc = await _shared(pool)
            rc.ending["one"] = error
            await _connect(pool, "one", "two", "three")
            if is_ended:
                rc.end("enough")
            await pool.clock.sleep_s(LEASE_S + 0.1)
            assert {"off for two", "off for three"} <= {*rc.diary}
            alarms = [event for event in rc.story.of("one") if event.level is LogLevel.ALARM]
            assert alarms
            assert str(error) in alarms[0].what
            if is_ended or isinstance(error, ValueError):
                assert await pool.outcome("lights") is (error if isinstance(error, ValueError) else None)
            else:
                assert rc.feedback == "free, not safe after one"

    run_virtual(main())


@pytest.mark.parametrize("error", [asyncio.CancelledError(), SystemExit(2)], ids=repr)
def test_a_safe_state_that_is_cut_off_ends_the_rc_and_leaves_no_other_hold(
    local_mission: Any, error: BaseException
) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            rc = await _shared(pool)
            rc.ending["one"] = error
            await _connect(pool, "one", "two", "three")
            with pytest.raises(NoResponder):
                await _order(pool, Disconnect("one", 1), Disconnected)
            assert isinstance(await pool.outcome("lights"), RuntimeError)
            assert rc.diary[-2:] == ["off for three", "off for two"]
            assert any(event.level is LogLevel.ALARM for event in rc.story.of("one"))

    run_virtual(main())


def test_what_is_not_safe_is_tried_again_when_the_rc_ends(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            rc = await _shared(pool)
            rc.ending["one"] = HardwareFault("lamp 1 glows")
            await _connect(pool, "one")
            with pytest.raises(HardwareFault):
                await _order(pool, Disconnect("one", 1), Disconnected)
            del rc.ending["one"]
            rc.end("enough")
            assert await pool.outcome("lights") is None
            assert rc.diary == ["on for one", "off for one", "off for one"]

    run_virtual(main())


@pytest.mark.parametrize("error", [KeyError("lamp 2"), asyncio.CancelledError(), SystemExit(2)], ids=repr)
def test_a_bug_in_a_connection_ends_the_rc_in_its_safe_state(local_mission: Any, error: BaseException) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            rc = await _shared(pool)
            rc.connecting["two"] = error
            with pytest.raises(NoResponder):
                await _connect(pool, "one", "two")
            assert isinstance(await pool.outcome("lights"), KeyError | RuntimeError)
            assert sorted(rc.diary[2:]) == ["off for one", "off for two"]

    run_virtual(main())


class SilentLamp(Lamp):
    """A lamp whose author forgot the applied values, or gave a text."""

    given: object = None

    async def obey(self, hold: Hold, order: Command) -> Any:
        return self.given


@pytest.mark.parametrize(
    "given",
    [None, {"brightness": "bright"}, {"brightness": "1"}, 1.0, {1: 1.0}, {"n" * 256: 1.0}, {"a": [1]}],
    ids=["none", "text", "number as text", "no mapping", "no name", "long name", "list"],
)
def test_what_obey_returned_in_place_of_applied_values_is_told(local_mission: Any, given: object) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            lamp = await pool.start(SilentLamp, "lights", {"driver": "resource_pool.rcs.skeleton:PaintedLamp"})
            lamp.given = given
            await _connect(pool, "one")
            with pytest.raises(NoResponder):
                await pool.voice("one").ask("resource_pool/lights", Shine(1.0).under("one", 1), Applied, within_s=1.0)
            bug = await pool.outcome("lights")
            returned = f"{__name__}:SilentLamp.obey returned {given!r:.80} for shine"
            assert str(bug) == f"{returned}; return the applied values, each name with a number"

    run_virtual(main())


def test_of_applied_values_a_number_that_is_not_finite_is_left_out(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            lamp = await pool.start(SilentLamp, "lights", {"driver": "resource_pool.rcs.skeleton:PaintedLamp"})
            lamp.given = {"range_m": float("nan"), "echo_s": float("inf"), "count": 10**400, "brightness": 1.0}
            await _connect(pool, "one")
            order = Shine(1.0).under("one", 1)
            applied = await pool.voice("one").ask("resource_pool/lights", order, Applied, within_s=1.0)
            assert applied.values == {"brightness": 1.0}

    run_virtual(main())


class WarmingLamp(Lamp):
    """A lamp that needs 0.3 s until it shines."""

    hurried = True

    async def obey(self, hold: Hold, order: Command) -> Mapping[str, float]:
        warm_s = self.clock.now_s() + 0.3
        while self.clock.now_s() < warm_s:
            try:
                await self.clock.sleep_until_s(warm_s)
            except asyncio.CancelledError:
                if self.hurried:
                    raise
        return await super().obey(hold, order)


@pytest.mark.parametrize("end", ["disconnection", "lease", "new connection", "end of the RC"])
def test_a_command_in_progress_does_not_follow_the_safe_state(local_mission: Any, end: str) -> None:
    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            lamp = await pool.start(WarmingLamp, "lights", {"driver": "resource_pool.rcs.skeleton:PaintedLamp"})
            await _connect(pool, "one")
            await pool.clock.sleep_s(LEASE_S - 0.1)
            shine = Shine(1.0).under("one", 1)
            shining = asyncio.create_task(pool.voice("one").ask("resource_pool/lights", shine, Applied, within_s=1.0))
            await pool.clock.sleep_s(0.05)
            match end:
                case "disconnection":
                    await _order(pool, Disconnect("one", 1), Disconnected)
                case "new connection":
                    await _order(pool, Connect("one", 2, LEASE_S, RcUse(), {}), Connected)
                case "end of the RC":
                    lamp.end("enough")
            with pytest.raises(StaleEpoch, match="before its command was carried out"):
                await shining
            await pool.clock.sleep_s(0.5)
            events = [event.what for event in lamp.story.of("lights")]
            assert "is dark" in events
            assert not [what for what in events if what.startswith("shines")]
            if end == "end of the RC":
                assert await pool.outcome("lights") is None

    run_virtual(main())


def _lit(lamp: Lamp) -> list[str]:
    """Return what the lamp's driver has told of."""
    return [event.what for event in lamp.story.of("lights") if event.what.startswith(("shines", "is dark"))]


class StuckLamp(Lamp):
    """Waits for a device that does not answer."""

    async def obey(self, hold: Hold, order: Command) -> Mapping[str, float]:
        await asyncio.Event().wait()
        return await super().obey(hold, order)


def test_a_command_that_does_not_end_is_told_with_its_place(local_mission: Any) -> None:
    """A driver that hung: health was ok, and neither status nor log had a word of it."""

    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            lamp = await pool.start(StuckLamp, "lights", {"driver": "resource_pool.rcs.skeleton:PaintedLamp"})
            await _connect(pool, "one")
            for _ in range(2):
                shine = Shine(1.0).under("one", 1)
                with pytest.raises(ReplyTimeout):
                    await pool.voice("one").ask("resource_pool/lights", shine, Applied, within_s=ANSWERS_WITHIN_S)
                await pool.clock.sleep_s(0.1)
                lamp.holds.renew("one", 1, pool.clock.now_s() + LEASE_S)
            place = f"{__file__}, line {StuckLamp.obey.__code__.co_firstlineno + 1}"
            told = f"a command has not ended within 0.8 s ({place})"
            assert lamp.feedback == f"held by one; {told}"
            said = [(event.what, event.level) for event in lamp.story.of("lights") if "not ended" in event.what]
            assert said == [(f"{told}; its ARC one got no answer", LogLevel.WARNING)], "once"
            await _order(pool, Disconnect("one", 1), Disconnected)
            assert lamp.feedback == "free"

    run_virtual(main())


def test_a_command_that_goes_on_after_its_cancellation_is_followed_by_the_safe_state(local_mission: Any) -> None:
    """Otherwise the lamp shines without a holder, and the RC manager took it for dark."""

    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            lamp = await pool.start(WarmingLamp, "lights", {"driver": "resource_pool.rcs.skeleton:PaintedLamp"})
            lamp.hurried = False
            await _connect(pool, "one")
            shine = Shine(1.0).under("one", 1)
            shining = asyncio.create_task(pool.voice("one").ask("resource_pool/lights", shine, Applied, within_s=1.0))
            await pool.clock.sleep_s(0.05)
            for _ in range(2):
                with pytest.raises(HardwareFault, match="a command goes on although it was cancelled"):
                    await _order(pool, Disconnect("one", 1), Disconnected)
                assert _lit(lamp)[-1] == "is dark", "at once, and again afterwards"
            with pytest.raises(StaleEpoch):
                await shining
            assert _lit(lamp)[-2:] == ["shines white at 100%", "is dark"]
            await _order(pool, Disconnect("one", 1), Disconnected)
            lamp.hurried = True
            await _order(pool, Connect("two", 2, LEASE_S, RcUse(), {}), Connected)

    run_virtual(main())
