"""A session that writes down what keys of the terminal console want."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from datetime import datetime
from typing import Any

import numpy as np
from console_scenes import model
from numpy.typing import NDArray
from textual.pilot import Pilot

from backbone.debug_views import ViewPicture, Views, ViewValue
from backbone.errors import LinkError, Refusal
from backbone.mission_log.log import AskLog, Log
from backbone.mission_log.question import LogQuestion
from backbone.moments import Now
from ui_console.model.console import ConsoleModel
from ui_console.model.driving import GiveWish, MoveWish
from ui_console.model.events import ConsoleEvent
from ui_console.model.key_table import KeyRow
from ui_console.model.key_view import KeyView
from ui_console.model.orders import Order
from ui_console.session.verbs import Session


class WrittenSession(Session):
    """Writes down what keys want."""

    def __init__(self, *events: ConsoleEvent, shown: ConsoleModel | None = None) -> None:
        super().__init__(shown or model(*events))
        self.wanted: list[Any] = []
        self.touched = 0
        self.must_let_go = 0
        self.is_closed = False
        self.shown: NDArray[np.uint8] | None = None
        self.is_sure = True
        self.log: Log | Refusal = Log([])
        self.views: dict[str, Views] = {}
        self.listed: list[list[KeyRow]] = []
        self.heard = KeyView("", {})
        self.seen: list[ViewPicture | ViewValue | Refusal] = []

    def picture(self) -> NDArray[np.uint8] | None:
        return self.shown

    def now_s(self) -> float:
        return 12.0

    def hold(self, move: MoveWish, lasts_s: float | None = None) -> None:
        self.wanted.append(move if lasts_s is None else (move, lasts_s))

    def stop(self) -> None:
        self.wanted.append("stop")

    def require_let_go(self) -> None:
        self.must_let_go += 1

    def dismiss_lost(self) -> None:
        self.wanted.append("dismiss lost")
        self.model.dismiss_lost()

    def closed(self) -> None:
        self.is_closed = True

    def give(self, wish: GiveWish) -> None:
        self.wanted.append(wish)

    def take(self) -> None:
        self.wanted.append("take")

    def release(self) -> None:
        self.wanted.append("release")

    def ask_consent(self, why: str = "") -> None:
        self.wanted.append(("may I", why))

    def decide(self, is_given: bool, number: int) -> None:
        self.wanted.append(("decide", is_given, number))

    async def switch(self, robot: str) -> None:
        self.wanted.append(("switch", robot))

    def order_group(self, orders: Sequence[Order]) -> None:
        self.wanted.append(("order", list(orders)))

    def touch(self) -> None:
        self.touched += 1

    def leave(self) -> None:
        self.wanted.append("leave")

    def acknowledge(self, key: str) -> None:
        self.wanted.append(("acknowledge", key))
        self.model.acknowledge(key)

    async def stop_robot(self, robot: str) -> bool:
        self.wanted.append(("stop robot", robot))
        return self.is_sure

    async def stop_all(self) -> list[str]:
        self.wanted.append("stop all")
        return [] if self.is_sure else ["scout2"]

    async def lift_stop(self, robot: str, number: int) -> bool:
        self.wanted.append(("lift", robot, number))
        return self.is_sure

    async def why(self, name: str) -> list[str]:
        self.wanted.append(("why", name))
        return [f"{name}: waiting", "  watch1 has its minimum run time"]

    async def search_log(self, question: LogQuestion) -> tuple[AskLog, Log]:
        asked = question.asked(Now(self.now_s(), datetime(2026, 5, 4, 14, 10)))
        self.wanted.append(("search", asked))
        if isinstance(self.log, Refusal):
            raise self.log
        return asked, self.log

    async def ask_parameters(self, name: str) -> bool:
        self.wanted.append(("ask", name))
        return True

    async def set_parameter(self, name: str, parameter: str, value: object) -> bool:
        self.wanted.append(("set", name, parameter, value))
        return self.is_sure

    async def debug_views(self) -> dict[str, Views]:
        self.wanted.append("views")
        return self.views

    async def keep_listing(self, show: Callable[[list[KeyRow]], None]) -> None:
        self.wanted.append("list")
        try:
            for rows in self.listed:
                show(rows)
                await asyncio.sleep(1.0)
            await asyncio.Event().wait()
        finally:
            self.wanted.append("lists no more")

    async def keep_hearing(self, row: KeyRow, begin: Callable[[KeyView], None]) -> None:
        self.wanted.append(("hear", *row.id))
        try:
            begin(self.heard)
            await asyncio.Event().wait()
        finally:
            self.wanted.append("hears no more")

    async def keep_looking(
        self,
        behavior: str,
        view: str,
        show: Callable[[ViewPicture | ViewValue], None],
        trouble: Callable[[Refusal | LinkError], None],
    ) -> None:
        self.wanted.append(("look", behavior, view))
        for seen in self.seen:
            if isinstance(seen, Refusal):
                trouble(seen)
            else:
                show(seen)
        try:
            await asyncio.Event().wait()
        finally:
            self.wanted.append("looks no more")


async def settle(pilot: Pilot[Any]) -> None:
    """Return when what keys began is done and drawn."""
    await pilot.app.workers.wait_for_complete()
    await pilot.pause()
    await pilot.pause()
