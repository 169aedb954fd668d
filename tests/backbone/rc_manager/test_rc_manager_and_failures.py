"""What the RC manager does when RCs, ARCs or itself fail: on the local bus."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import msgspec
import pytest
from rc_manager_at_work import HARDWARE, PlainArc, request
from trace_checker import check

from backbone.addresses import PLACER, RC_MANAGER
from backbone.bus.clock import run_virtual
from backbone.component.messages import NameTaken
from backbone.keys import Conversation
from backbone.naming import Subsystem
from backbone.placer.messages import Start
from backbone.rc_manager.messages import (
    Beat,
    Done,
    SetIdle,
)
from backbone.rc_manager.rc_watch import MEET_LATEST_S
from backbone.scheduling.requests import (
    LEASE_S,
)
from backbone.wire import Envelope, Message


def test_the_death_of_an_arc_frees_its_rcs(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            waiting = await here.arc("waiting")
            launch = here.launch(Subsystem.RESOURCE_POOL, "dying", "plain_arc")
            dying = PlainArc(launch, here.network.join(launch.address, here.clock), here.clock)
            async with here.beside(dying):
                await dying.ask_for(request("dying", "left", "radio"))
                await waiting.ask_for(request("waiting", "left", "radio"))
                await here.clock.sleep_s(1.0)
                assert dying.is_open
            await here.clock.sleep_s(0.5)
            assert waiting.is_open
            assert set(here.rcs["left"].holders) == {"waiting"}

    run_virtual(main())


def test_an_arc_that_no_longer_beats_loses_its_rcs(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            hung, waiting = await here.arc("hung"), await here.arc("waiting")
            await hung.ask_for(request("hung", "left", "radio", minimum_runtime_s=60.0))
            await waiting.ask_for(request("waiting", "left", "radio"))
            await here.clock.sleep_s(1.0)
            hung.beats = False
            await here.clock.sleep_s(3.0)
            assert waiting.is_open

    run_virtual(main())


def test_beats_of_another_component_do_not_keep_an_arc_that_hangs(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            hung, waiting = await here.arc("hung"), await here.arc("waiting")
            await hung.ask_for(request("hung", "left", "radio", minimum_runtime_s=60.0))
            await waiting.ask_for(request("waiting", "left", "radio"))
            await here.clock.sleep_s(1.0)
            hung.beats = False
            for _ in range(6):
                waiting.bus.publish(waiting.address, Conversation.BEAT, Beat("hung"))
                await here.clock.sleep_s(0.5)
            assert waiting.is_open

    run_virtual(main())


def test_an_arc_that_reports_rcs_it_cannot_have_asked_for_harms_nobody(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            odd, sound = await here.arc("odd"), await here.arc("sound")
            odd.request, odd.rcs = request("odd", "left", "radio"), ["left"]
            await here.clock.sleep_s(3.0)
            assert set(odd.epochs) == {"left", "radio"}, "it was asked for its request, and got what that says"
            await sound.ask_for(request("sound", "left", "radio"))
            await here.clock.sleep_s(6.0)
            assert sound.is_open

    run_virtual(main())


def test_an_rc_that_dies_takes_only_its_own_arc_along(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one, two = await here.arc("one"), await here.arc("two")
            await one.ask_for(request("one", "left", "radio"))
            await two.ask_for(request("two", "right", "radio"))
            await here.clock.sleep_s(0.5)
            assert one.is_open
            assert two.is_open
            here.rcs["left"].end("it is killed")
            await here.clock.sleep_s(3.0)
            assert not one.is_open
            assert one.log[-1][0] == "rc"
            assert two.is_open
            await here.rc(HARDWARE[0])
            await here.clock.sleep_s(0.5)
            assert one.is_open

    run_virtual(main())


def test_an_rc_that_does_not_confirm_counts_as_held_until_its_lease_is_over(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one, two = await here.arc("one"), await here.arc("two")
            await one.ask_for(request("one", "left", "radio"))
            await here.clock.sleep_s(1.0)
            here.rcs["left"].hangs = True
            asked_s = here.clock.now_s()
            await two.ask_for(request("two", "radio", "left", priority=100))
            await here.clock.sleep_s(LEASE_S - 0.1)
            assert not one.is_open
            assert not two.is_open
            await here.clock.sleep_s(0.2)
            here.rcs["left"].hangs = False
            here.rcs["left"].holders.clear()
            await here.clock.sleep_s(2.0)
            assert two.is_open
            assert two.granted_s >= asked_s + LEASE_S - 1e-6

    run_virtual(main())


def test_an_arc_that_hangs_delays_nobody(pool: Any) -> None:
    """Its epochs are over as soon as its RCs have disconnected."""

    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one, two = await here.arc("one"), await here.arc("two")
            await one.ask_for(request("one", "left", "radio"))
            await here.clock.sleep_s(1.0)
            one.hangs = True
            asked_s = here.clock.now_s()
            await two.ask_for(request("two", "radio", "left", priority=100))
            await here.clock.sleep_s(1.5)
            assert two.is_open
            assert two.granted_s - asked_s < 0.25  # the grace of 0.2 s, and the time of the messages

    run_virtual(main())


def test_an_rc_that_was_away_is_free_as_soon_as_it_says_so_itself(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one = await here.arc("one")
            await one.ask_for(request("one", "left", "radio"))
            await here.clock.sleep_s(1.0)
            here.rcs["left"].end("it is killed")
            await here.clock.sleep_s(0.3)
            assert not one.is_open
            came_back_s = here.clock.now_s()
            await here.rc(HARDWARE[0])
            await here.clock.sleep_s(LEASE_S)
            assert one.is_open
            assert one.granted_s - came_back_s < 0.3  # and not only when the lease of its earlier life is over

    run_virtual(main())


def test_the_other_rcs_of_an_arc_do_not_wait_for_one_that_died(pool: Any) -> None:
    """Its successor confirms instead, before it is counted as up."""

    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one, two = await here.arc("one"), await here.arc("two")
            await one.ask_for(request("one", "left", "video"))
            await two.ask_for(request("two", "right", "video"))
            await here.clock.sleep_s(1.0)
            assert one.is_open
            here.rcs["left"].end("it is killed")
            await here.clock.sleep_s(0.3 + 0.2)
            assert two.is_open
            successor = await here.rc(HARDWARE[0])
            await here.clock.sleep_s(6.0)
            assert one.is_open
            assert successor.log == [("disconnect", "one"), ("connect", "one")]

    run_virtual(main())


def test_an_rc_that_does_not_confirm_in_time_and_has_no_other_holder_is_down_until_it_does(pool: Any) -> None:
    async def main() -> Path:
        async with pool() as here, here.beside(here.manager()):
            one = await here.arc("one")
            await one.ask_for(request("one", "left", "radio"))
            await here.clock.sleep_s(1.0)
            here.rcs["left"].hangs = True
            await one.bus.ask(RC_MANAGER, SetIdle("one", True), Done, within_s=1)
            await here.clock.sleep_s(LEASE_S + 0.1)
            here.rcs["left"].hangs = False
            await here.clock.sleep_s(LEASE_S)
            return here.trace  # type: ignore[no-any-return]

    lines = [json.loads(line) for line in run_virtual(main()).read_text().splitlines()]
    ended = next(number for number, line in enumerate(lines) if line["ev"] == "revoke")
    told = [line for line in lines[ended:] if line.get("id") == "left" or line.get("arc") == "one"]
    assert [line.get("state", line["ev"]) for line in told] == ["revoke", "down", "free", "up"]
    assert told[2]["t"] - told[0]["t"] <= 0.2 + 0.05  # grace and tolerance
    assert check(lines) == []


def test_the_other_rcs_of_an_arc_do_not_wait_for_one_whose_hardware_does_not_obey(pool: Any) -> None:
    async def main() -> Path:
        async with pool() as here, here.beside(here.manager()):
            one, two = await here.arc("one"), await here.arc("two")
            await one.ask_for(request("one", "left", "video"))
            await here.clock.sleep_s(1.0)
            here.rcs["left"].does_not_obey = True
            await two.ask_for(request("two", "video", priority=100))
            await here.clock.sleep_s(0.2 + 0.05 + 0.3)  # grace, tolerance, settling
            assert two.is_open
            here.rcs["left"].does_not_obey = False
            await here.clock.sleep_s(2 * LEASE_S)
            await two.bus.ask(RC_MANAGER, SetIdle("two", True), Done, within_s=1)
            await here.clock.sleep_s(0.5)
            assert one.is_open, "it counts as up again as soon as it obeys"
            return here.trace  # type: ignore[no-any-return]

    assert check([json.loads(line) for line in run_virtual(main()).read_text().splitlines()]) == []


def test_a_set_that_cannot_be_connected_whole_is_given_back_whole(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            here.rcs["video"].holders["somebody else"] = 1
            one = await here.arc("one")
            await one.ask_for(request("one", "left", "video", "radio"))
            await here.clock.sleep_s(0.1)
            assert not one.is_open
            assert here.rcs["left"].log[:2] == [("connect", "one"), ("disconnect", "one")]
            assert here.rcs["left"].holders == {}
            here.rcs["video"].holders.clear()
            await here.clock.sleep_s(1.0)
            assert one.is_open

    run_virtual(main())


def test_an_rc_that_cannot_be_connected_takes_other_rcs_from_their_holders_less_and_less(pool: Any) -> None:
    """The console wants a robot that is broken, and with it the frequency of another robot."""

    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            behavior, console = await here.arc("behavior"), await here.arc("console")
            here.rcs["left"].is_broken = True
            await behavior.ask_for(request("behavior", "right", "video"))
            await console.ask_for(request("console", "left", "video", priority=100))
            await here.clock.sleep_s(120.0)
            closed_s = [at_s for what, _, at_s in behavior.log if what == "higher"]
            assert len(closed_s) <= 12
            assert closed_s[-1] - closed_s[-2] > 3 * 5.0, "the behavior gets whole slices"
            here.rcs["left"].is_broken = False
            await here.clock.sleep_s(MEET_LATEST_S + 1.0)
            assert console.is_open

    run_virtual(main())


def test_a_restarted_rc_manager_adopts_the_running_arc_and_remembers_the_waiting_one(pool: Any) -> None:
    """ARCHITECTURE, rule 5: truth lives at the edge."""

    async def main() -> None:
        async with pool() as here:
            one, two = await here.arc("one"), await here.arc("two")
            async with here.beside(here.manager()):
                await one.ask_for(request("one", "left", "video", "radio"))
                await two.ask_for(request("two", "right", "video", "radio"))
                await here.clock.sleep_s(2.0)
                assert one.is_open
                epochs = dict(one.epochs)
            async with here.beside(here.manager()):
                await here.clock.sleep_s(0.5)
                assert one.epochs == epochs
                assert [what for what, *_ in one.log] == ["open"]
                await here.clock.sleep_s(5.0)
                assert two.is_open
                assert min(two.epochs.values()) > 0
            assert here.rcs["video"].log[:2] == [("connect", "one"), ("disconnect", "one")]

    run_virtual(main())


def test_the_trace_after_a_restart_shows_the_slice_that_goes_on_as_it_was(pool: Any) -> None:
    """Its RCs settled and its slice began before the restart: nothing was granted now, nothing unsettled."""

    async def main() -> tuple[Path, float]:
        async with pool() as here:
            one, two = await here.arc("one"), await here.arc("two")
            async with here.beside(here.manager()):
                await one.ask_for(request("one", "left", "video", "radio"))
                await two.ask_for(request("two", "right", "video", "radio"))
                await here.clock.sleep_s(2.0)
            granted_s = one.granted_s
            async with here.beside(here.manager()):
                await here.clock.sleep_s(8.0)
            return here.trace, granted_s

    trace, granted_s = run_virtual(main())
    lines = [json.loads(line) for line in trace.read_text().splitlines()]
    lines = lines[[line["ev"] for line in lines].index("meta", 1) :]
    grant = next(line for line in lines if line["ev"] == "grant")
    assert (grant["arc"], grant["t"]) == ("one", pytest.approx(granted_s))
    assert [line["arc"] for line in lines if line["ev"] == "grant"] == ["one", "two"]
    assert check(lines) == []


def test_the_trace_after_a_restart_shows_that_an_adopted_arc_wants_no_time_now(pool: Any) -> None:
    async def main() -> Path:
        async with pool() as here:
            one, two = await here.arc("one"), await here.arc("two")
            async with here.beside(here.manager()):
                await one.ask_for(request("one", "left", "radio"))
                await two.ask_for(request("two", "left", "radio"))
                await here.clock.sleep_s(2.0)
            assert one.request is not None
            one.request = msgspec.structs.replace(one.request, idle=True)
            async with here.beside(here.manager()):
                await here.clock.sleep_s(1.0)
                assert (one.is_open, two.is_open) == (False, True)
            return here.trace

    lines = [json.loads(line) for line in run_virtual(main()).read_text().splitlines()]
    lines = lines[[line["ev"] for line in lines].index("meta", 1) :]
    assert [line["ev"] for line in lines if line.get("arc") == "one"][-3:] == ["idle", "revoke", "free"]
    assert check(lines) == []


def test_a_restarted_rc_manager_frees_what_a_dead_arc_left_held(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here:
            here.rcs["left"].holders["ghost"] = 7
            here.rcs["left"].last_epoch = 7
            async with here.beside(here.manager()):
                one = await here.arc("one")
                await one.ask_for(request("one", "left", "radio"))
                await here.clock.sleep_s(0.2)
                assert one.is_open
                assert one.epochs["left"] > 7

    run_virtual(main())


def test_a_request_for_an_rc_that_the_placer_brings_back_waits_for_it(pool: Any) -> None:
    """Its host was lost, say: the placer has it in its book and starts it as soon as it can."""

    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            placer = here.network.join(PLACER, here.clock)

            async def answer(asked: Envelope[Any]) -> Message:
                raise NameTaken(f"{asked.body.name} is waiting on no host yet")

            placer.serve(PLACER, Start, answer)
            here.rcs["left"].end("its host is lost")
            await here.clock.sleep_s(0.5)
            arc = await here.arc("arc")
            assert (await arc.ask_for(request("arc", "left", "radio"))).rcs
            await here.clock.sleep_s(5.0)
            assert not arc.is_open
            await here.rc(HARDWARE[0])
            await here.clock.sleep_s(1.0)
            assert arc.is_open
            await placer.close()

    run_virtual(main())
