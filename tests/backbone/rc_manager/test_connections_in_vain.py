"""A connection that fails because an RC hangs is undone, and its other RCs do not wait for that one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from rc_manager_at_work import request
from trace_checker import check

from backbone.bus.clock import run_virtual
from backbone.rc_manager.context_switch import ARC_REPLY_S, RC_REPLY_S
from backbone.scheduling.requests import LEASE_S


def test_the_other_rcs_of_a_connection_in_vain_do_not_wait_for_one_that_hangs(pool: Any) -> None:
    async def main() -> Path:
        async with pool() as here, here.beside(here.manager()):
            behavior, console = await here.arc("behavior"), await here.arc("console")
            await behavior.ask_for(request("behavior", "right", "video", minimum_runtime_s=60.0))
            await here.clock.sleep_s(1.0)
            here.rcs["left"].hangs = True
            asked_s = here.clock.now_s()
            await console.ask_for(request("console", "left", "video", priority=100))
            await here.clock.sleep_s(RC_REPLY_S + 0.3 + 0.2)  # a reply that does not come, settling, and the messages
            assert behavior.is_open
            assert behavior.granted_s > asked_s
            here.rcs["left"].hangs = False
            await here.clock.sleep_s(2 * LEASE_S)
            assert console.is_open
            return here.trace  # type: ignore[no-any-return]

    assert check([json.loads(line) for line in run_virtual(main()).read_text().splitlines()]) == []


def test_nor_do_they_wait_for_one_that_hangs_after_it_was_connected(pool: Any) -> None:
    """The console's ARC hangs, too, so it does not open its gate."""

    async def main() -> Path:
        async with pool() as here, here.beside(here.manager()):
            behavior, console = await here.arc("behavior"), await here.arc("console")
            await behavior.ask_for(request("behavior", "right", "video", minimum_runtime_s=60.0))
            await here.clock.sleep_s(1.0)
            await console.ask_for(request("console", "left", "video", priority=100))
            console.hangs = True
            await here.clock.sleep_s(0.1)
            here.rcs["left"].hangs = True
            asked_s = here.clock.now_s()
            await here.clock.sleep_s(ARC_REPLY_S + 0.3 + 0.2 + 0.2)  # also until the hung ARC counts as closed
            assert behavior.is_open
            assert behavior.granted_s > asked_s
            here.rcs["left"].hangs = console.hangs = False
            here.rcs["left"].holders.clear()
            await here.clock.sleep_s(4 * LEASE_S)
            assert console.is_open
            return here.trace  # type: ignore[no-any-return]

    assert check([json.loads(line) for line in run_virtual(main()).read_text().splitlines()]) == []


def test_a_shared_rc_on_a_slow_link_is_free_when_it_confirms_and_not_only_after_its_lease(pool: Any) -> None:
    """Its first answer comes after the grace, and another ARC holds it, too, so the switch waits for it."""

    async def main() -> float:
        async with pool() as here, here.beside(here.manager()):
            other, behavior, console = [await here.arc(name) for name in ("other", "behavior", "console")]
            await other.ask_for(request("other", "radio", minimum_runtime_s=60.0))
            await behavior.ask_for(request("behavior", "left", "radio", minimum_runtime_s=60.0))
            await here.clock.sleep_s(1.0)
            here.rcs["radio"].confirms_after_s = 0.3
            asked_s: float = here.clock.now_s()
            await console.ask_for(request("console", "left", priority=100))
            await here.clock.sleep_s(2 * LEASE_S)
            assert other.is_open
            return float(console.granted_s) - asked_s

    assert 0.3 < run_virtual(main()) < 0.5
