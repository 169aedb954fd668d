"""Debug views for browsers: each view is subscribed to and encoded once, however many browsers watch it."""

from __future__ import annotations

import asyncio
import itertools
import logging
from collections.abc import Callable, Coroutine, Iterable
from typing import NamedTuple, Protocol

from backbone.bus.interface import Bus, Clock
from backbone.debug_views import ViewPicture, ViewValue
from backbone.errors import LinkError, Refusal
from backbone.naming import Subsystem, address
from backbone.printable import printable_all
from ui_console.model.debug_views import SeenViews, view_rows
from ui_console.session.looking import keep_looking, pixels_of, views_of
from ui_console.web.pictures import jpeg, packet

log = logging.getLogger(__name__)

LIST_EVERY_S = 1.0  # chosen: a person reads values more slowly; machine seconds


class PageSight(NamedTuple):
    """The behavior and view that a page watches.

    Attributes:
        behavior: Name; empty: none.
        view: Name of the picture; empty: only the list.
    """

    behavior: str = ""
    view: str = ""

    @property
    def stream(self) -> str:
        """Name of its picture stream; unlike a robot's stream it contains a slash. Empty: no pictures."""
        return f"{self.behavior}/{self.view}" if self.behavior and self.view else ""


class Looker(Protocol):
    """A browser that watches debug views."""

    sight: PageSight

    def show_views(self, seen: SeenViews) -> None:
        """Show the list of a behavior."""

    def saw_view(self, stream: str, number: int, at_s: float, packed: bytes) -> None:
        """Show a picture of a view."""


class Sights:
    """Watches exactly the views that its clients watch.

    Args:
        bus: Bus of the server.
        clock: The mission's clock.
        clients: Returns the connected browsers.
        start_task: Runs a coroutine until the server ends; a bug in it ends the server.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        clients: Callable[[], Iterable[Looker]],
        start_task: Callable[[Coroutine[object, None, None], str], asyncio.Task[None]],
    ) -> None:
        self._bus, self._clock, self._clients, self._start_task = bus, clock, clients, start_task
        self._looks: dict[PageSight, asyncio.Task[None]] = {}
        self._numbers = itertools.count(1)

    @property
    def looked_at(self) -> frozenset[PageSight]:
        """Every list and picture that a page shows."""
        return frozenset(self._looks)

    def changed(self) -> None:
        """Begin and end subscriptions, because a client came, left, or watches another view."""
        sights = [client.sight for client in self._clients() if client.sight.behavior]
        wanted = {PageSight(one.behavior) for one in sights} | {one for one in sights if one.view}
        for sight in self._looks.keys() - wanted:
            self._looks.pop(sight).cancel()
        for sight in wanted - self._looks.keys():
            work = self._look(sight) if sight.view else self._list(sight.behavior)
            self._looks[sight] = self._start_task(work, f"look at {sight.behavior} {sight.view}")

    async def _list(self, behavior: str) -> None:
        while True:
            try:
                entries = (await views_of(self._bus, address(Subsystem.MISSION_CONTROL, behavior))).views
                seen = SeenViews(behavior, view_rows(entries))
            except Refusal as refusal:
                seen = SeenViews(behavior, [], refusal.detail)
            except LinkError as error:
                seen = SeenViews(behavior, [], f"no answer: {error}")
            for client in self._clients():
                if client.sight.behavior == behavior:
                    client.show_views(printable_all(seen))
            await self._clock.sleep_s(LIST_EVERY_S * self._clock.rate)

    async def _look(self, sight: PageSight) -> None:
        def saw(shown: ViewPicture | ViewValue) -> None:
            if isinstance(shown, ViewPicture) and shown.pixels:
                self._show(sight, shown)

        while True:
            try:
                at = address(Subsystem.MISSION_CONTROL, sight.behavior)
                await keep_looking(self._bus, self._clock, at, sight.view, saw)
            except (Refusal, LinkError) as error:  # the page shows the list's trouble and the picture's age
                log.info("%s is not seen: %s", sight.stream, error)
            await self._clock.sleep_s(LIST_EVERY_S * self._clock.rate)

    def _show(self, sight: PageSight, shown: ViewPicture) -> None:
        number = next(self._numbers)
        packed = packet(sight.stream, number, shown.at_s, jpeg(pixels_of(shown)))
        for client in self._clients():
            if client.sight == sight:
                client.saw_view(sight.stream, number, shown.at_s, packed)
