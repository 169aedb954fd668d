"""What a restarted RC manager makes of the ARCs that it finds, and what a long life costs it: on the local bus."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import rc_manager_at_work
from msgspec.structs import replace
from rc_manager_at_work import HARDWARE, Pool, request
from trace_checker import check

from backbone.bus.clock import run_virtual


def test_an_adopted_arc_that_no_longer_fits_is_revoked_at_once(pool: Any) -> None:
    """The radio's capacity was lowered while no RC manager ran: the ARC drove on, and kept its robot from others."""

    async def main() -> Path:
        async with pool() as here:
            one, two = await here.arc("one"), await here.arc("two")
            async with here.beside(here.manager()):
                await one.ask_for(request("one", "left", "radio"))
                await two.ask_for(request("two", "right", "radio"))
                await here.clock.sleep_s(1.0)
            await _restart_with_little_capacity(here, one, two)
            return here.trace

    _require_a_revocation_for_capacity(run_virtual(main()))


def test_an_adopted_arc_is_revoked_at_once_if_the_capacity_was_raised_before_and_lowered_since(
    pool: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was not adopted, and held its robot until its lease ended, while the RC manager counted it as waiting."""
    narrow = [replace(one, capacity=0.05) if one.sharable else one for one in HARDWARE]
    monkeypatch.setattr(rc_manager_at_work, "HARDWARE", narrow)

    async def main() -> Path:
        async with pool() as here:
            one, two = await here.arc("one"), await here.arc("two")
            async with here.beside(here.manager()):
                await one.ask_for(request("one", "left", "radio"))
                await two.ask_for(request("two", "right", "radio"))
                await here.clock.sleep_s(1.0)
                assert one.is_open
                assert two.is_open
            await _restart_with_little_capacity(here, one, two)
            return here.trace

    _require_a_revocation_for_capacity(run_virtual(main()))


async def _restart_with_little_capacity(here: Pool, one: Any, two: Any) -> None:
    """Lower the radio's capacity while no RC manager runs: the next one revokes the second ARC at once."""
    here.rcs["radio"].tells = lambda state: replace(state, capacity=0.05)
    async with here.beside(here.manager()):
        await here.clock.sleep_s(0.1)
        assert (one.is_open, two.is_open) == (True, False)
        assert {*here.rcs["radio"].holders} == {"one"}
        assert not here.rcs["right"].holders
        await here.clock.sleep_s(6.0)
        assert two.is_open, "it gets its turn"


def _require_a_revocation_for_capacity(trace: Path) -> None:
    lines = [json.loads(line) for line in trace.read_text().splitlines()]
    lines = lines[[line["ev"] for line in lines].index("meta", 1) :]
    assert next(line["why"] for line in lines if line["ev"] == "revoke") == "capacity"
    assert check(lines) == []


def test_the_trace_after_a_restart_shows_growing_epochs_also_if_a_short_settling_overtook_a_long_one(pool: Any) -> None:
    """The radio's epoch of the one that settled longer was connected first, and granted last."""

    async def main() -> Path:
        async with pool() as here:
            one, two = await here.arc("one"), await here.arc("two")
            async with here.beside(here.manager()):
                await one.ask_for(request("one", "left", "video", "radio"))
                await here.clock.sleep_s(0.1)
                await two.ask_for(request("two", "right", "radio"))
                await here.clock.sleep_s(1.0)
                assert two.granted_s < one.granted_s
                assert two.epochs["radio"] > one.epochs["radio"]
            async with here.beside(here.manager()):
                await here.clock.sleep_s(8.0)
                assert (one.is_open, two.is_open) == (True, True)
            return here.trace

    lines = [json.loads(line) for line in run_virtual(main()).read_text().splitlines()]
    begin = [line["ev"] for line in lines].index("meta", 1)
    assert check(lines[:begin]) == []
    assert check(lines[begin:]) == []
    grants = [line["epoch"] for line in lines[begin:] if line["ev"] == "grant"]
    assert [sorted(epochs) for epochs in grants] == [["left", "video"], ["radio", "right"]]


def test_waiting_arcs_keep_their_places_in_line_over_a_restart(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here:
            arcs = [await here.arc(name) for name in ("first", "second", "third")]
            async with here.beside(here.manager()):
                for arc in arcs:
                    await arc.ask_for(request(arc.name, "left"))
                await here.clock.sleep_s(6.0)
                assert arcs[1].is_open
            async with here.beside(here.manager()):
                await here.clock.sleep_s(5.0)
                assert arcs[2].is_open, "the first one had its turn before it"

    run_virtual(main())


def test_an_rc_that_dies_again_and_again_leaves_nothing_in_the_rc_manager(pool: Any) -> None:
    """Each death left a hold that had not been ended, for ever."""

    async def main() -> None:
        async with pool() as here:
            manager = here.manager()
            async with here.beside(manager):
                one = await here.arc("one")
                await one.ask_for(request("one", "left", "video"))
                for _ in range(5):
                    await here.clock.sleep_s(1.0)
                    assert one.is_open
                    here.rcs["left"].end("it is killed")
                    await here.clock.sleep_s(3.0)
                    await here.rc(HARDWARE[0])
                left = vars(vars(manager)["_context_switch"])["_left"]
                assert len(left["left"]) <= 1

    run_virtual(main())
