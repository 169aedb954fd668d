"""The table of stops: how long wheels turn after a stop, from every screen of every console, or the console's warning.

``bench/stops.py [--console NAME …] [--link NAME …] [--place TEXT] [--first N] [--within S] [--table [FILE]]``. Each
cell is tried on one real mission: the robots turn, the stop is given at a place of a console, and the poses of the
simulated world show when the wheels stood. Prints one JSON line for each cell. ``--table`` prints the Markdown of the
lines in FILE, or of this run.

Exit code 1: a cell has a fault: no answer, or more than ``--within`` seconds although the link is up.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import re
import signal
import sys
import tempfile
import time
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from pathlib import Path
from typing import Any

from measuring import MISSION_XML, report
from missions import mission_up
from playwright.async_api import Error as PageError
from stops_headless import Headless
from stops_link import relay_to_mission
from stops_page import page_present
from stops_places import KINDS, OPERATOR, OTHERS, OWN_STOP, ROBOT, Cell, Gesture, Link, cells
from stops_table import markdown
from stops_terminal import CANNOT, Script, Terminal, TriedConsole
from stops_world import ROBOTS, NotSeen, World, until, world_of

from backbone import run_files
from backbone.errors import LinkError, Refusal

MISSION = "stops"
STANDS_WITHIN_S = 0.5  # the bound of an emergency stop
SETTLED_S = 0.25  # chosen: a robot that has not moved for so long stands
WATCHED_S = 2.0  # chosen: a stop is watched so long, and longer if ``--within`` allows it to take longer
SAYS_WITHIN_S = 3.0  # chosen: a page that sleeps needs a moment to wake
AWAKE_S = 1.0  # chosen: a page that slept needs a moment
TURNS_WITHIN_S = 1.0
PRESSES = 2
ATTEMPTS = 4  # an order to stop that was given without a link may arrive at any time


class Runner:
    """Tries cells of one console.

    Args:
        within_s: Longest legal duration of a stop.
    """

    def __init__(self, console: TriedConsole, world: World, within_s: float = STANDS_WITHIN_S) -> None:
        self._console, self._world, self._within_s = console, world, within_s

    async def try_cells(self, tried: list[Cell]) -> list[dict[str, Any]]:
        """Return the results of these cells, each with its fault if it has one.

        Args:
            tried: One cell, or several cells of one place that take turns during one loss of the link.
        """
        try:
            await self._prepare(tried[0])
            if tried[0].link in (Link.UP, Link.OTHER):
                found = [await self._stop(cell) for cell in tried]
            else:
                found = await self._stop_without_link([cell.gesture for cell in tried], tried[0].link)
        except (NotSeen, AssertionError, PageError, Refusal, LinkError) as error:
            found = [{"fault": f"could not be tried: {error}"}] * len(tried)
        await self._clean_up(tried[0])
        return found

    async def _prepare(self, cell: Cell) -> None:
        """Make all robots turn, and bring the console to the place of the cell."""
        for _ in range(ATTEMPTS - 1):
            with suppress(NotSeen):
                await self._turn_all(cell)
                break
            await self._console.let_go()
        else:
            await self._turn_all(cell)
        if cell.place.needs == "asked":
            await self._world.asker.ask_for_it()
        await self._console.go(cell.place)
        if cell.link is Link.OTHER and cell.place.meant != ROBOT:
            await self._console.shows_meant(cell.place.meant)

    async def _turn_all(self, cell: Cell) -> None:
        world, needs = self._world, cell.place.needs
        is_stopped = needs in ("stopped", OWN_STOP)
        await world.all_may_move()
        if is_stopped:
            await world.stop(OTHERS[1], *([OPERATOR] if needs == OWN_STOP else []))
        others = world.others_turn(OTHERS[:1] if is_stopped else OTHERS)
        for fault in await asyncio.gather(others, self._turn_own(cell), return_exceptions=True):
            if fault is not None:
                raise fault

    async def _turn_own(self, cell: Cell) -> None:
        """Make the console's robot turn, by another operator or by the console itself."""
        world, console = self._world, self._console
        if cell.link is Link.OTHER or not console.kind.drives:
            await console.take()
            if console.kind.drives:
                await until(world.console_asks, f"{console.name} asks for {ROBOT}")
            await world.holder.turn()
            await until(lambda: world.poses.turns(ROBOT), f"{ROBOT} turns")
            return
        await world.holder.leave()
        await console.take()
        await until(world.console_holds, f"{console.name} holds {ROBOT}")
        for _ in range(PRESSES):  # keys held before the console was ready are released and pressed again
            await console.drive()
            with suppress(NotSeen):
                await until(lambda: world.poses.turns(ROBOT), f"{ROBOT} turns", TURNS_WITHIN_S)
                return
            await console.let_go()
        raise NotSeen(f"{ROBOT} does not turn: {await console.says()}")

    async def _clean_up(self, cell: Cell) -> None:
        await self._console.let_go()
        with suppress(NotSeen, PageError):
            await self._console.leave(cell.place)
        if cell.place.needs == "asked":
            await self._world.asker.leave()

    async def _stop(self, cell: Cell) -> dict[str, Any]:
        world = self._world
        meant = self._meant(cell)
        orders = {robot: world.orders(robot) for robot in ROBOTS}
        moved = {robot for robot in meant if world.poses.turns(robot)}
        given_s = self._mission_s(await self._console.give(cell.gesture))
        heard_s: dict[str, float] = {}

        def is_over() -> bool:
            for robot in meant:
                if world.orders(robot) > orders[robot]:
                    heard_s.setdefault(robot, world.clock.now_s())
            return len(heard_s) == len(meant) and not any(map(self._moves, meant))

        with suppress(NotSeen):
            await until(is_over, "the robots stand", max(WATCHED_S, self._within_s + SETTLED_S))
        found: dict[str, Any] = {"moved": sorted(moved), "says": await self._console.says()}
        silent = sorted(set(meant) - heard_s.keys())
        moving = [robot for robot in meant if self._moves(robot)]
        too_many = [robot for robot in set(ROBOTS) - set(meant) if world.orders(robot) > orders[robot]]
        if silent or moving or too_many:
            by = {robot: world.poses.moved_by(robot, SETTLED_S) for robot in moving}
            return {**found, "moved_by": by, "fault": _faults(silent, moving, too_many)}
        stood_s = [world.poses.moved_last_s(robot, given_s) or given_s for robot in meant]
        latched_s = [world.stopped_s(robot, given_s) or heard_s[robot] for robot in meant]
        found["stands_s"] = round(max(*stood_s, *latched_s) - given_s, 3)
        found["latched_s"] = round(max(latched_s) - given_s, 3)
        if (acted_s := world.acted_s(given_s)) is not None:
            found["acted_s"] = round(acted_s - given_s, 3)
        if found["stands_s"] > self._within_s:
            found["fault"] = f"more than {self._within_s:g} s"
        return found

    def _moves(self, robot: str) -> bool:
        poses = self._world.poses
        return poses.moved_last_s(robot, self._world.clock.now_s() - SETTLED_S) is not None

    def _meant(self, cell: Cell) -> tuple[str, ...]:
        if cell.gesture.is_for_all:
            return ROBOTS
        is_pointed = cell.link is Link.OTHER and cell.gesture in (Gesture.ONE, Gesture.PAD_ONE)
        return (cell.place.meant if is_pointed else ROBOT,)

    def _mission_s(self, monotonic_s: float) -> float:
        return self._world.clock.now_s() - (time.monotonic() - monotonic_s)

    async def _stop_without_link(self, gestures: list[Gesture], link: Link) -> list[dict[str, Any]]:
        """Cut the link or freeze the console, give the stops, and return the wheels' and the console's reactions."""
        world, console = self._world, self._console
        moved = world.poses.turns(ROBOT) and console.kind.drives
        await console.aim(gestures)
        away_s = world.clock.now_s()
        giving: list[asyncio.Task[float]] = []
        rows: list[dict[str, Any]] = []
        if link is Link.CUT:
            console.relay.cut()
        else:
            await console.freeze()
        try:
            if link is Link.FROZEN:
                giving = [asyncio.create_task(console.give(gesture), name=gesture) for gesture in gestures]
            found = await self._stands_by_itself(away_s) if moved else {}
            for gesture in gestures if link is Link.CUT else []:
                await console.give(gesture)
                rows.append({**found, **await self._said(away_s)})
                away_s = -1.0  # the delay of the warning counts once
        finally:
            if link is Link.CUT:
                console.relay.heal()
            else:
                await console.thaw()
        if giving:
            await asyncio.wait(giving)
            await asyncio.sleep(AWAKE_S)
            rows = [{**found, "says": await console.says()} for _ in gestures]
        if moved and self._moves(ROBOT):
            return [{**row, "fault": f"{ROBOT} turns although its console was away"} for row in rows]
        return [row if row["says"] else {**row, "fault": "the console says nothing"} for row in rows]

    async def _stands_by_itself(self, away_s: float) -> dict[str, Any]:
        with suppress(NotSeen):
            await until(lambda: not self._moves(ROBOT), f"{ROBOT} stands", WATCHED_S)
        last_s = self._world.poses.moved_last_s(ROBOT, away_s)
        return {"moved": [ROBOT], "stands_s": round((last_s or away_s) - away_s, 3)}

    async def _said(self, away_s: float) -> dict[str, Any]:
        """Return the warning of a console that is cut off, and its delay."""
        heard: list[str] = []

        async def is_said() -> bool:
            heard[:] = [await self._console.says()]
            return re.search(CANNOT, heard[0]) is not None

        try:
            await until(is_said, "the console says that it is cut off", SAYS_WITHIN_S)
        except NotSeen:
            return {"says": heard[0], "fault": "it does not say that it is cut off"}
        said = {"says": heard[0]}
        return said if away_s < 0 else {**said, "said_s": round(self._world.clock.now_s() - away_s, 3)}


def _faults(silent: list[str], moving: list[str], too_many: list[str]) -> str:
    parts = [
        (silent, "not told to stop"),
        (moving, "still turning"),
        (too_many, "stopped though not meant"),
    ]
    return "; ".join(f"{what}: {', '.join(robots)}" for robots, what in parts if robots)


@asynccontextmanager
async def console_at_hand(name: str) -> AsyncIterator[TriedConsole]:
    """Run a console whose link can be cut."""
    async with AsyncExitStack() as stack:
        if name.startswith("page"):
            environment = {"XDG_RUNTIME_DIR": os.environ["XDG_RUNTIME_DIR"]}
            yield await stack.enter_async_context(page_present(name, environment, MISSION))
            return
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="stops-")))
        relay = await stack.enter_async_context(relay_to_mission(run_files.find(MISSION), folder))
        environment = {"XDG_RUNTIME_DIR": str(folder)}
        console = (
            Script(name, relay)
            if name == "script"
            else (Headless if name == "headless" else Terminal)(name, relay, folder)
        )
        yield await stack.enter_async_context(console.present(environment, MISSION))


def together(wanted: list[Cell]) -> list[list[Cell]]:
    """Return the cells that are tried together: those of one place during one loss of the link; else single cells."""
    groups: dict[tuple[Any, ...], list[Cell]] = {}
    for cell in wanted:
        is_away = cell.link in (Link.CUT, Link.FROZEN)
        groups.setdefault((cell.place, cell.link, is_away or cell.gesture), []).append(cell)
    return list(groups.values())


async def try_all(wanted: list[Cell], within_s: float) -> list[dict[str, Any]]:
    """Try these cells, print each result as soon as it is known, and return all."""
    rows = []
    trying = asyncio.current_task()
    assert trying is not None
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, trying.cancel)  # nothing is left behind
    async with world_of(MISSION) as world:
        for name in dict.fromkeys(cell.console for cell in wanted):
            async with console_at_hand(name) as console:
                runner = Runner(console, world, within_s)
                for tried in together([cell for cell in wanted if cell.console == name]):
                    for cell, found in zip(tried, await runner.try_cells(tried), strict=True):
                        row = {"console": name, "place": cell.place.name, "gesture": cell.gesture, "link": cell.link}
                        rows.append({**row, **found})
                        report("stops", **rows[-1])
                        sys.stdout.flush()
            await world.holder.leave()
    return rows


def main() -> int:
    """Try the selected cells."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--console", nargs="+", choices=[*KINDS], default=[*KINDS])
    asked.add_argument("--link", nargs="+", choices=[*Link], default=[*Link])
    asked.add_argument("--place", default="", help="regular expression")
    asked.add_argument("--first", type=int, default=sys.maxsize, help="so many cells of each console and link")
    asked.add_argument("--within", type=float, default=STANDS_WITHIN_S, help="seconds a stop may take")
    asked.add_argument("--table", nargs="?", const="", default=None, metavar="FILE")
    words = asked.parse_args()
    if words.table:
        print(markdown(Path(words.table).read_text().splitlines()))
        return 0
    wanted = [
        cell
        for name in words.console
        for link in words.link
        for cell in [cell for cell in cells(name) if cell.link == link and re.search(words.place, cell.place.name)][
            : words.first
        ]
    ]
    with mission_up(MISSION_XML, name=MISSION):
        rows = asyncio.run(try_all(wanted, words.within))
    if words.table is not None:
        print(markdown(rows))
    return int(any("fault" in row for row in rows))


if __name__ == "__main__":
    sys.exit(main())
