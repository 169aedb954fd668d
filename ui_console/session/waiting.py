"""Tasks while a console waits for a robot: find the reason, and settle a hold of the same person at another screen."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable

from backbone.addresses import RC_MANAGER
from backbone.errors import LinkError, Refusal
from backbone.rc_manager.messages import AskWhy
from backbone.scheduling.views import Why
from ui_console.model.events import Heard
from ui_console.session.feed import REPLY_TIME_S
from ui_console.session.hand_over import HandOver
from ui_console.session.observer import AnyObserver

log = logging.getLogger(__name__)


class Waiting:
    """Asks again after each change of the schedule.

    Args:
        hand_over: Messages with this person's other screens.
        waits_for: Returns the robot for which the console waits, and the begin of the wait; None: it no longer waits.
    """

    def __init__(
        self, console: AnyObserver, hand_over: HandOver, waits_for: Callable[[], tuple[str, float] | None]
    ) -> None:
        self._console, self._hand_over, self._waits_for = console, hand_over, waits_for
        self._asking: asyncio.Task[None] | None = None

    def ask(self, arc: str) -> None:
        """Ask why this ARC waits, if it does, unless an earlier question is still open."""
        if self._asking is None and self._waits_for() is not None:
            self._asking = self._console.start_task(self._ask(arc), "why")

    async def _ask(self, arc: str) -> None:
        console = self._console
        try:
            why = await console.bus.ask(RC_MANAGER, AskWhy(arc), Why, within_s=REPLY_TIME_S)
            if (waits_for := self._waits_for()) is not None:
                console.show(Heard(console.clock.now_s(), why))
                await self._hand_over.settle(*waits_for)
        except (Refusal, LinkError) as error:
            log.info("why: %s", error)
        finally:
            self._asking = None
