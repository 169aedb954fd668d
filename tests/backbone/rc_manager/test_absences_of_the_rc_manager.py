"""The RC manager names RCs that run and cannot be used, and ARCs that want time and cannot run."""

from __future__ import annotations

from typing import Any

import pytest
from rc_manager_at_work import HARDWARE, request

from backbone.addresses import PLACER, RC_MANAGER
from backbone.bus.clock import run_virtual
from backbone.component.messages import Absence, AskState, ComponentState
from backbone.creator.messages import AskLoad, HostLoad
from backbone.errors import Refusal
from backbone.keys import Conversation
from backbone.nameserver.messages import Components
from backbone.nameserver.registry import Registry
from backbone.placer.messages import Start, Started
from backbone.rc_manager.failures import WORKS_AGAIN_S
from backbone.rc_manager.messages import AskRc, Connect, Disconnect, RcState
from backbone.rc_manager.rc_watch import MEET_LATEST_S
from backbone.scheduling.arc_events import RETRY_S
from backbone.scheduling.requests import LEASE_S
from backbone.wire import Envelope, Message


class NotReady(Refusal):
    """An ARC cannot tune its receiver."""

    code = "test.not_ready"
    remedy = ""


async def _absent(of: Any) -> dict[str, Absence]:
    state = await of.bus.ask(RC_MANAGER, AskState(), ComponentState, within_s=1)
    return {absence.name: absence for absence in state.absent}


def test_an_rc_whose_hardware_is_not_safe_is_named_until_it_is(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            holder = await here.arc("holder")
            await holder.ask_for(request("holder", "left"))
            await here.clock.sleep_s(1.0)
            assert not await _absent(holder)
            here.rcs["left"].does_not_obey = True
            await holder.ask_for(request("holder", "right"))
            await here.clock.sleep_s(2 * LEASE_S)
            absence = (await _absent(holder))["left"]
            assert absence.is_running
            assert absence.doing
            assert "left is not safe" in absence.cause
            here.rcs["left"].does_not_obey = False
            await here.clock.sleep_s(2 * LEASE_S)
            assert not await _absent(holder)

    run_virtual(main())


def test_an_rc_that_is_connected_in_vain_is_named_until_it_is_connected(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            holder = await here.arc("holder")
            here.rcs["left"].is_broken = True
            await holder.ask_for(request("holder", "left"))
            for _ in range(40):
                await here.clock.sleep_s(0.25)
                assert "left is broken" in (await _absent(holder))["left"].cause
            here.rcs["left"].is_broken = False
            await here.clock.sleep_s(MEET_LATEST_S)
            assert not await _absent(holder)

    run_virtual(main())


@pytest.mark.parametrize(
    ("own_host", "round_trip_s", "cpu", "remedy"),
    [
        ("here", 0.6, 0.5, "examine its hardware"),
        ("here", 60.0, 0.5, "examine its hardware"),
        ("here", 0.6, 0.97, "run less on here: 97% of its processor time is used"),
        ("base", 0.02, 0.5, "examine its hardware"),
        ("base", 0.02, 0.97, "run less on here: 97% of its processor time is used"),
        ("base", 0.6, 0.5, "check the link to here: a round trip takes 0.60 s"),
        ("base", 60.0, 0.5, "check the link to here: its creator does not answer either"),
    ],
)
def test_the_remedy_for_an_rc_that_does_not_answer_names_a_slow_link_or_a_full_processor(
    pool: Any, own_host: str, round_trip_s: float, cpu: float, remedy: str
) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager(own_host)):
            asker, creator = await here.arc("asker"), here.network.join("backbone/creator-here", here.clock)

            async def answer(_asked: Envelope[AskLoad]) -> Message:
                await here.clock.sleep_s(round_trip_s)
                return HostLoad("here", [], cpu, 0.5, 2, 3)

            creator.serve("backbone/creator-here", AskLoad, answer)
            here.rcs["left"].hangs = True
            here.rcs["left"].changed()
            await asker.ask_for(request("asker", "left"))
            await here.clock.sleep_s(5.0)
            assert remedy in (await _absent(asker))["left"].remedy
            await creator.close()

    run_virtual(main())


def test_silent_rcs_of_one_host_cost_no_lists_and_one_measurement_a_second(
    pool: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    lists: list[str] = []
    loads: list[Envelope[AskLoad]] = []
    components = Registry.components

    def counted(registry: Registry, *of: Any) -> Components:
        lists.append("asked for")
        return components(registry, *of)

    monkeypatch.setattr(Registry, "components", counted)

    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            creator = here.network.join("backbone/creator-here", here.clock)

            async def answer(asked: Envelope[AskLoad]) -> Message:
                loads.append(asked)
                return HostLoad("here", [], 1.0, 0.5, 2, 3)

            creator.serve("backbone/creator-here", AskLoad, answer)
            for name, rc in here.rcs.items():
                rc.hangs = True
                asker = await here.arc(f"asker-{name}")
                await asker.ask_for(request(asker.name, name))
            lists.clear()
            await here.clock.sleep_s(10.0)
            absent = await _absent(asker)
            assert all("run less on here" in absent[name].remedy for name in here.rcs)
            await creator.close()

    run_virtual(main())
    assert not lists
    assert 1 <= len(loads) <= 11


def test_an_rc_that_does_not_answer_is_named(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            asker = await here.arc("asker")
            here.rcs["left"].hangs = True
            here.rcs["left"].changed()
            await asker.ask_for(request("asker", "left"))
            await here.clock.sleep_s(3.0)
            assert (await _absent(asker))["left"].cause

    run_virtual(main())


def test_an_arc_that_opens_in_vain_is_named_while_it_wants_time(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            odd = await here.arc("odd")
            odd.cannot_open = NotReady("odd could not be prepared: no picture")
            await odd.ask_for(request("odd", "left"))
            for _ in range(20):
                await here.clock.sleep_s(0.25)
                assert "no picture" in (await _absent(odd))["odd"].cause
            odd.cannot_open = None
            await here.clock.sleep_s(20.0)
            assert odd.is_open
            assert not await _absent(odd)

    run_virtual(main())


@pytest.mark.parametrize("in_vain", [1, 2])
def test_an_arc_that_waits_for_others_is_named_only_if_it_failed_repeatedly(pool: Any, in_vain: int) -> None:
    """After a cut link one ARC's gate stayed shut once; it waited for a higher one, and health stayed degraded."""

    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            odd, higher = await here.arc("odd"), await here.arc("higher")
            odd.cannot_open = NotReady("odd could not be prepared: no picture")
            await odd.ask_for(request("odd", "left"))
            await here.clock.sleep_s(0.5 + (in_vain - 1) * RETRY_S)
            assert "odd" in await _absent(odd)
            await higher.ask_for(request("higher", "left", priority=100))
            await here.clock.sleep_s(20.0)
            assert higher.is_open
            assert ("odd" in await _absent(odd)) is (in_vain > 1)

    run_virtual(main())


@pytest.mark.parametrize(("own_host", "remedy"), [("base", "check the link to here: a round trip"), ("here", "")])
def test_the_remedy_for_an_arc_that_opens_in_vain_names_the_slow_link_to_its_rcs(
    pool: Any, own_host: str, remedy: str
) -> None:
    """A receiver behind a link with a round trip of 0.4 s could not be tuned, and health named no remedy."""

    async def main() -> None:
        async with pool() as here, here.beside(here.manager(own_host)):
            odd, creator = await here.arc("odd"), here.network.join("backbone/creator-here", here.clock)

            async def answer(_asked: Envelope[AskLoad]) -> Message:
                await here.clock.sleep_s(0.4)
                return HostLoad("here", [], 0.5, 0.5, 2, 3)

            creator.serve("backbone/creator-here", AskLoad, answer)
            odd.cannot_open = NotReady("odd could not be prepared: left did not answer")
            await odd.ask_for(request("odd", "left"))
            await here.clock.sleep_s(5.0)
            found = (await _absent(odd))["odd"].remedy
            assert found.startswith(remedy)
            assert bool(found) is bool(remedy)
            await creator.close()

    run_virtual(main())


def test_an_arc_that_the_radio_could_not_serve_even_alone_is_named(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            fast = await here.arc("fast")
            await fast.ask_for(request("fast", "radio"))
            await here.clock.sleep_s(1.0)
            assert not await _absent(fast)
            radio = here.rcs["radio"]
            state = RcState("radio", "command_radio", True, 0.001, [], radio.last_epoch, 0, 0)
            radio.bus.publish(radio.address, Conversation.TELEMETRY, state)
            await here.clock.sleep_s(1.0)
            absence = (await _absent(fast))["fast"]
            assert absence.cause == "radio could not serve it even alone"
            assert absence.doing == "waits until the capacity of radio grows"

    run_virtual(main())


@pytest.mark.parametrize("lost", [Connect, Disconnect, AskRc])
def test_one_lost_packet_is_not_told(pool: Any, lost: type[Message]) -> None:
    """The RC manager acts on it at once; health was degraded for half a second."""

    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one, two = await here.arc("one"), await here.arc("two")
            await one.ask_for(request("one", "left"))
            await two.ask_for(request("two", "left"))
            if lost is AskRc:
                here.rcs["left"].end("it is killed")
                await here.clock.sleep_s(0.1)
                await here.rc(HARDWARE[0], loses=[AskRc])
            else:
                here.rcs["left"].loses[lost] = 1
            for _ in range(80):
                await here.clock.sleep_s(0.1)
                assert not await _absent(one)
            assert one.is_open or two.is_open

    run_virtual(main())


@pytest.mark.parametrize("is_broken", [True, False])
def test_an_rc_that_fails_again_and_again_is_told_once(pool: Any, is_broken: bool) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one, two = await here.arc("one"), await here.arc("two")
            await one.ask_for(request("one", "left"))
            await two.ask_for(request("two", "left"))
            told: list[Absence | None] = []
            for tenth in range(800):
                if tenth % 100 == 20 and tenth < 400:  # a connection in each second slice
                    here.rcs["left"].is_broken = is_broken
                    if not is_broken:
                        here.rcs["left"].loses[Connect] = 1
                if tenth % 100 == 80:
                    here.rcs["left"].is_broken = False
                absence = (await _absent(one)).get("left")
                if (told[-1] if told else None) != absence:
                    told.append(absence)
                await here.clock.sleep_s(0.1)
            assert told[-1] is None, f"it has worked for {WORKS_AGAIN_S} s"
            assert len([absence for absence in told if absence is None]) <= 2
            assert any(absence is not None and absence.is_repeated for absence in told)

    run_virtual(main())


def test_an_rc_that_was_checked_twice_at_once_is_not_absent_if_one_check_found_it(pool: Any) -> None:
    """It appeared, and the placer had started it: the check without an answer ended last, and named it for good."""

    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            holder = await here.arc("holder")
            placer = here.network.join(PLACER, here.clock)

            async def answer(_asked: Envelope[Start]) -> Message:
                left = await here.rc(HARDWARE[0], loses=[AskRc])
                return Started(left.address, "here", 1, [])

            placer.serve(PLACER, Start, answer)
            here.rcs["left"].end("it is killed")
            await here.clock.sleep_s(0.1)
            await holder.ask_for(request("holder", "left"))
            for _ in range(40):
                await here.clock.sleep_s(0.1)
                assert holder.is_open
                assert not await _absent(holder)
            await placer.close()

    run_virtual(main())
