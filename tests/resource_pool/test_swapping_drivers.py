"""Drivers are exchanged while their RC works: the old one does the calls that the new one cannot."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Awaitable, Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import pytest
from driver_bench import Bench
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pool_on_local_network import Pool, WiretappedRadio, a_pool
from pool_orders import command, connect, connect_robot

from backbone.addresses import PLACER
from backbone.bus.clock import run_virtual
from backbone.component.messages import AskParameters, Parameters, WrongParameter
from backbone.dependency_database.messages import Resource
from backbone.errors import Refusal
from backbone.exchange import ExchangeRunning, SwapClass, Swapped
from backbone.keys import Conversation
from backbone.placer.messages import ReviseStart, StartRevised
from backbone.rc_manager.messages import Connect, Connected, Disconnect, Disconnected
from backbone.reading_anew import WrongClass
from backbone.scheduling.requests import RcUse
from backbone.wire import Envelope
from resource_pool.commands import Drive, Tune
from resource_pool.drivers.interface import HardwareFault, UnknownDriver
from resource_pool.messages import Applied, Frame
from resource_pool.rcs.skeleton import Lamp, Shine

DRIVERS = "exchanged_drivers"
AT = "resource_pool/lamp1"


class OpenedLamp(Lamp):
    """The lamp, whose device is opened."""

    async def connect(self) -> None:
        await super().connect()
        await self._driver.open()  # type: ignore[attr-defined]


PAIRS = [("First", "Second"), ("FirstBeside", "SecondBeside")]
FAULTS = ["open", "open late", "open wrongly", "open cut", "call", "call wrongly", "call cut", "hang", "task", "text"]


@pytest.fixture(autouse=True)
def _fresh_bench() -> None:
    Bench.clear()


async def swap(pool: Pool, name: str, prove_s: float = 1.0, at: str = AT, **options: Any) -> Swapped:
    path = name if ":" in name or name == "simulated" else f"{DRIVERS}:{name}"
    asked = SwapClass(path, options, prove_s, 2.0, user="anna")
    return await pool.voice_of("ui_console/tester").ask(at, asked, Swapped, within_s=60.0)


def add_placer(pool: Pool) -> None:
    """Let a placer take the order for the next start, so that an exchange ends at once."""

    async def revise(_asked: Envelope[ReviseStart]) -> StartRevised:
        return StartRevised()

    pool.voice_of(PLACER).serve(PLACER, ReviseStart, revise)


async def shine(pool: Pool, brightness: float) -> Applied:
    return await pool.voice("one").ask(AT, Shine(brightness).under("one", 1), Applied, within_s=2)


async def lit(pool: Pool, driver: str) -> None:
    await pool.start(OpenedLamp, "lamp1", {"driver": f"{DRIVERS}:{driver}"})
    await pool.manager_voice.ask(AT, Connect("one", 1, 30.0, RcUse(), {}), Connected, within_s=1)


def bench(local_mission: Any, driver: str, scene: Callable[[Pool], Awaitable[None]]) -> None:
    """Let a lamp with this driver be held, and play the scene."""

    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            await lit(pool, driver)
            await scene(pool)

    run_virtual(main())


@pytest.mark.parametrize(("old", "new"), PAIRS)
def test_another_driver_works_on_between_two_calls_with_the_state(local_mission: Any, old: str, new: str) -> None:
    async def scene(pool: Pool) -> None:
        await shine(pool, 0.5)
        swapped = await swap(pool, new)
        assert (swapped.is_proved, swapped.cause, swapped.keeps_state) == (True, "", True)
        assert Bench.shone == [(old, 0.5), (new, 0.5)], "the lamp shines on"
        await shine(pool, 0.7)
        assert Bench.shone[-1] == (new, 0.7)
        assert Bench.opened == [new]
        assert Bench.most_open == (2 if old == "FirstBeside" else 1)
        told = await pool.voice("one").ask(AT, AskParameters(), Parameters, within_s=1)
        assert told.values["driver"] == f"{DRIVERS}:{new}"
        assert (await swap(pool, old)).is_proved, "and back"

    bench(local_mission, old, scene)


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize(("old", "new"), PAIRS)
def test_the_old_driver_does_what_the_new_one_cannot(local_mission: Any, old: str, new: str, fault: str) -> None:
    async def scene(pool: Pool) -> None:
        await shine(pool, 0.5)
        Bench.fault = fault
        swapping = asyncio.create_task(swap(pool, new))
        for _ in range(10):
            await pool.clock.sleep_s(0.05)
            await shine(pool, 0.7)
        swapped = await swapping
        cause = {"open late": "not open", "open wrongly": "Zero", "call wrongly": "planted", "hang": "longer"}
        cause |= dict.fromkeys(("open cut", "call cut"), "raised CancelledError")
        cause |= {"open": "no such", "call": "loose"} | dict.fromkeys(("task", "text"), "pulled")
        assert not swapped.is_proved
        assert cause[fault] in swapped.cause
        assert Bench.opened == [old]
        await shine(pool, 0.9)
        assert Bench.shone[-1] == (old, 0.9)
        assert pool.is_alive("lamp1")
        Bench.fault = ""
        assert (await swap(pool, new)).is_proved

    bench(local_mission, old, scene)


def test_an_old_driver_that_awaits_its_cancelled_task_when_it_is_closed_holds_up_nothing(local_mission: Any) -> None:
    async def scene(pool: Pool) -> None:
        assert (await swap(pool, "Second")).is_proved
        await shine(pool, 0.7)
        assert Bench.shone[-1] == ("Second", 0.7)

    bench(local_mission, "CutAtItsEnd", scene)


def test_an_old_driver_that_hangs_when_it_is_opened_again_ends_the_rc(local_mission: Any) -> None:
    """Otherwise the RC never does a call again, nor reaches its safe state, and nothing starts it anew."""

    async def scene(pool: Pool) -> None:
        Bench.fault = "open"
        swapping = asyncio.create_task(swap(pool, "Second"))
        await pool.clock.sleep_s(30.0)
        assert not pool.is_alive("lamp1")
        bug = await pool.outcome("lamp1")
        assert isinstance(bug, HardwareFault)
        assert "Sticky did not open again" in str(bug)
        await asyncio.gather(swapping, return_exceptions=True)

    bench(local_mission, "Sticky", scene)


def test_refusals_change_nothing(local_mission: Any) -> None:
    async def scene(pool: Pool) -> None:
        with pytest.raises(WrongClass, match="lacks close, open, set_brightness"):
            await swap(pool, "NoLamp")
        with pytest.raises(WrongClass, match="name 'flaot' is not defined"):
            await swap(pool, "Mistyped")
        with pytest.raises(UnknownDriver):
            await swap(pool, "simulated")
        with pytest.raises(Refusal, match="no_such"):
            await swap(pool, "no_such_file:Lamp")
        with pytest.raises(WrongParameter, match="refuses its options"):
            await swap(pool, "Second", color="red")
        first = asyncio.create_task(swap(pool, "Second", 3.0))
        await pool.clock.sleep_s(0.5)
        with pytest.raises(ExchangeRunning):
            await swap(pool, "First")
        assert (await first).is_proved
        await pool.rc("scout1")
        with pytest.raises(WrongClass, match="lacks"):
            await swap(pool, "Second", at="resource_pool/scout1")

    bench(local_mission, "First", scene)


@contextmanager
def the_pool_is_read_anew() -> Iterator[None]:
    """Let the module of the pool be the old one again afterwards."""
    mine = sys.modules["pool_on_local_network"]
    try:
        yield
    finally:
        sys.modules["pool_on_local_network"] = mine


@pytest.mark.parametrize("fault", ["call", "hang"])
@pytest.mark.parametrize(("old", "new"), PAIRS)
def test_a_driver_without_a_trial_that_cannot_restore_the_state_ends_the_rc(
    local_mission: Any, old: str, new: str, fault: str
) -> None:
    """Otherwise a fault is silent, and a hang refuses each further exchange, also that to a driver that works."""

    async def scene(pool: Pool) -> None:
        Bench.fault = fault
        swapping = asyncio.create_task(swap(pool, new, prove_s=0.0))
        await pool.clock.sleep_s(10.0)
        assert not pool.is_alive("lamp1")
        assert isinstance(await pool.outcome("lamp1"), HardwareFault)
        await asyncio.gather(swapping, return_exceptions=True)

    bench(local_mission, old, scene)


def test_an_old_driver_that_hangs_when_its_state_is_restored_ends_the_rc(local_mission: Any) -> None:
    async def scene(pool: Pool) -> None:
        Bench.fault = "stuck"
        swapping = asyncio.create_task(swap(pool, "Second"))
        await pool.clock.sleep_s(10.0)
        assert not pool.is_alive("lamp1")
        bug = await pool.outcome("lamp1")
        assert isinstance(bug, HardwareFault)
        assert "First did not restore" in str(bug)
        await asyncio.gather(swapping, return_exceptions=True)

    bench(local_mission, "First", scene)


EVENTS = st.lists(
    st.tuples(st.sampled_from(["shine", "connect", "disconnect", "swap"]), st.sampled_from(["", *FAULTS])), max_size=10
)


@pytest.mark.parametrize("pair", PAIRS)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])  # the bench is cleared by each example
@given(EVENTS)
def test_no_call_is_lost_and_nothing_shines_without_a_holder(
    local_mission: Any, pair: tuple[str, str], events: Sequence[tuple[str, str]]
) -> None:
    async def scene(pool: Pool) -> None:
        epoch, brightness, swaps = 1, 0.0, list[asyncio.Task[Swapped]]()
        for number, (event, fault) in enumerate(events):
            match event:
                case "shine" if epoch:
                    brightness = (number + 1) / 100
                    await pool.voice("one").ask(AT, Shine(brightness).under("one", epoch), Applied, within_s=5)
                case "connect" if not epoch:
                    epoch = number + 2
                    await pool.manager_voice.ask(AT, Connect("one", epoch, 30.0, RcUse(), {}), Connected, within_s=1)
                case "disconnect" if epoch:
                    await pool.manager_voice.ask(AT, Disconnect("one", epoch), Disconnected, within_s=1)
                    epoch, brightness = 0, 0.0
                case "swap":
                    Bench.fault = fault
                    swaps.append(asyncio.create_task(swap(pool, pair[1] if number % 2 else pair[0], 0.5)))
            if Bench.shone:
                assert Bench.shone[-1][1] == brightness
        await asyncio.gather(*swaps, return_exceptions=True)
        Bench.fault = ""
        assert pool.is_alive("lamp1")
        assert len(Bench.opened) == 1
        assert Bench.shone == [] or Bench.shone[-1] == (Bench.opened[0], brightness)

    Bench.clear()
    bench(local_mission, pair[0], scene)


def test_a_radio_goes_on_under_the_same_grant(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio"], manager=False) as pool:
            add_placer(pool)
            await connect_robot(pool, "one", 1)
            await command(pool, "one", 1, Drive(3.0, 3.0))
            swapped = await swap(pool, "pool_on_local_network:WiretappedRadio", at="resource_pool/radio")
            assert swapped.is_proved, swapped.cause
            assert swapped.rounds > 3
            before, after = WiretappedRadio.built[0], sys.modules["pool_on_local_network"].WiretappedRadio.built[0]
            assert before.closed == 1
            assert not {packet.at_s for packet in before.heard} & {packet.at_s for packet in after.heard}
            assert after.heard[0].robot_epoch == before.heard[-1].robot_epoch
            after.breaks = True
            assert isinstance(await pool.outcome("radio"), HardwareFault), "a proved driver that breaks ends its RC"

    with the_pool_is_read_anew():
        run_virtual(main())


def test_a_radio_that_comes_back_hears_its_robots_again(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1"], manager=False) as pool:
            await pool.rc("radio", driver="simulated")
            for rc in ("radio", "scout1"):
                await connect(pool, rc, "one", 1, lease_s=30.0, companions={"scout1": 1, "radio": 1})
            await command(pool, "one", 1, Drive(3.0, 3.0))
            await pool.clock.sleep_s(1.0)
            swapped = await swap(pool, "AbsentRadio", at="resource_pool/radio")
            assert "no such port" in swapped.cause
            heard = pool.running["radio"].statistics()["replies"]
            assert heard > 0
            await pool.clock.sleep_s(2.0)
            assert pool.running["radio"].statistics()["replies"] >= heard + 3
            assert pool.running["radio"].statistics()["replies_lost"] <= 1

    run_virtual(main())


def test_a_grabber_delivers_on_and_only_once(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["video", "grabber"], manager=False) as pool:
            frames: list[Frame] = []
            ear = pool.voice("ear")
            ear.subscribe("resource_pool/one", Conversation.FRAMES, Frame, lambda heard: frames.append(heard.body))
            grabber = "resource_pool/grabber"
            await pool.manager_voice.ask(grabber, Connect("one", 7, 30.0, RcUse(), {}), Connected, within_s=1)
            await pool.voice("one").ask(grabber, Tune("video", "scout1").under("one", 7), Applied, within_s=1)
            old = pool.grabber_driver
            swapping = asyncio.create_task(swap(pool, "pool_on_local_network:HandOperatedGrabber", at=grabber))
            await pool.clock.sleep_s(0.5)
            new = sys.modules["pool_on_local_network"].HandOperatedGrabber.built[-1]
            for driver in (old, new):
                driver.deliver(driver.picture())
            await pool.clock.sleep_s(0.1)
            assert (new.frequency, [(one.number, one.epoch) for one in frames]) == ("video", [(1, 7)])
            await pool.manager_voice.ask(grabber, Disconnect("one", 7), Disconnected, within_s=1)
            assert new.frequency == ""
            assert (await swapping).is_proved

    with the_pool_is_read_anew():
        run_virtual(main())


def a_camera(local_mission: Any, scene: Callable[[Pool], Awaitable[None]]) -> None:
    """Let an ARC hold a camera that can be opened once, and play the scene."""
    camera = Resource("camera", "framegrabber", driver=f"{DRIVERS}:FirstCamera", links={"video_frequency": ["video"]})

    async def main() -> None:
        async with a_pool(local_mission, ["camera"], manager=False, hardware=[camera]) as pool:
            await held_and_tuned(pool, 1)
            await scene(pool)

    run_virtual(main())


async def held_and_tuned(pool: Pool, epoch: int) -> None:
    at = "resource_pool/camera"
    await pool.manager_voice.ask(at, Connect("one", epoch, 30.0, RcUse(), {}), Connected, within_s=1)
    await pool.voice("one").ask(at, Tune("video", "").under("one", epoch), Applied, within_s=1)


def test_a_camera_that_is_opened_again_delivers_as_before(local_mission: Any) -> None:
    async def scene(pool: Pool) -> None:
        assert Bench.tuned == {"FirstCamera": "video"}
        Bench.fault = "open"
        assert "no such device" in (await swap(pool, "SecondCamera", at="resource_pool/camera")).cause
        assert Bench.tuned == {"FirstCamera": "video"}

    a_camera(local_mission, scene)


@pytest.mark.parametrize(("fault", "closed_s"), [("", 0.3), ("open", 0.3), ("task", 0.8)])
def test_a_grant_may_pass_on_while_no_camera_is_open(local_mission: Any, fault: str, closed_s: float) -> None:
    async def scene(pool: Pool) -> None:
        Bench.fault = fault
        swapping = asyncio.create_task(swap(pool, "SecondCamera", at="resource_pool/camera"))
        await pool.clock.sleep_s(closed_s)
        assert Bench.tuned == {}
        await pool.manager_voice.ask("resource_pool/camera", Disconnect("one", 1), Disconnected, within_s=1)
        await held_and_tuned(pool, 2)
        assert (await swapping).is_proved is (fault == "")
        assert Bench.tuned == {"FirstCamera" if fault else "SecondCamera": "video"}

    a_camera(local_mission, scene)


def test_a_protocol_is_exchanged_under_the_robot_s_name(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["scout1", "radio"], manager=False) as pool:
            add_placer(pool)
            await connect_robot(pool, "one", 1)
            at = "resource_pool/scout1"
            Bench.fault = "call"
            swapping = asyncio.create_task(swap(pool, "exchanged_drivers:LoudProtocol", at=at))
            await pool.clock.sleep_s(0.2)
            await command(pool, "one", 1, Drive(2.0, 2.0))
            assert "too loud" in (await swapping).cause
            Bench.fault = ""
            assert (await swap(pool, "exchanged_drivers:LoudProtocol", at=at)).is_proved
            told = await pool.voice("one").ask(at, AskParameters(), Parameters, within_s=1)
            assert told.values["protocol"] == "exchanged_drivers:LoudProtocol"
            await command(pool, "one", 1, Drive(3.0, 3.0))

    run_virtual(main())
