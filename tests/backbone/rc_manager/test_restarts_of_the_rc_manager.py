"""What a restarted RC manager makes of the ARCs that it finds, and what a long life costs it: on the local bus."""

from __future__ import annotations

from typing import Any

from rc_manager_at_work import HARDWARE, request

from backbone.bus.clock import run_virtual


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
