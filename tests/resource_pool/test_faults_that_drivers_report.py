"""A fault that a driver reports between its calls ends the RC, whichever thread reports it."""

from __future__ import annotations

import asyncio
import threading
from typing import Any

from exchanged_drivers import First

from resource_pool.driver_exchange import DriverExchanges
from resource_pool.drivers.interface import DriverSite


class FakeRc:
    """Notes why it fails, and in which thread."""

    def __init__(self) -> None:
        self.failed = list[tuple[str, int]]()

    def fail(self, bug: BaseException) -> None:
        self.failed.append((str(bug), threading.get_ident()))


def test_a_fault_that_a_thread_of_the_driver_reports_ends_the_rc_in_its_loop() -> None:
    """Otherwise a loop in which nothing else happens does not note it, and its own lists are changed in two threads."""

    async def main() -> None:
        rc: Any = FakeRc()
        driver: Any = DriverExchanges(rc).made(First, DriverSite("lamp1", rc, rc, rc, print, rc.fail))
        await asyncio.to_thread(driver.site.fail, OSError("pulled"))
        await asyncio.sleep(0)
        assert rc.failed == [("pulled", threading.get_ident())]

    asyncio.run(main())
