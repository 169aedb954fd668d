"""A patrol on real processes that two consoles take over and give back at random, and what is heard of it."""

from __future__ import annotations

import asyncio
import random
import statistics
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from consoles_at_work import WAIT_S, Console

from backbone.bus.interface import Bus
from backbone.component.messages import AskStatistics, ComponentState, Parameters, SetParameter, Statistics
from backbone.keys import Conversation
from backbone.wire import Envelope
from mission_control.messages import WaypointReached
from resource_pool.arc_client import Suspended
from ui_console.model.driving import DriveWish, MoveWish

A_WAY_S = 20.0
FOR_GOOD = 0.25  # share of the releases after which the next take-over starts a new process
WORLD = "resource_pool/world"
DRIVEN_WITHIN_S = 0.150
RESUMED_WITHIN_S = 0.300


@dataclass
class Measured:
    """How long things took, seconds."""

    driven: list[float] = field(default_factory=list)
    resumed: list[float] = field(default_factory=list)

    @property
    def is_quick(self) -> bool:
        """Whether all was done within the limits, which hold for a machine that has nothing else to do."""
        return max(self.driven) < DRIVEN_WITHIN_S and max(self.resumed) < RESUMED_WITHIN_S

    def __str__(self) -> str:
        return f"driven {_summary(self.driven)}\nresumed {_summary(self.resumed)}"


@dataclass
class Watch:
    """What a patrol publishes: its way points, and its feedback with the times.

    Args:
        patrol: Its address.
    """

    patrol: str
    reached: list[WaypointReached] = field(default_factory=list)
    said: list[tuple[float, str]] = field(default_factory=list)
    changed: asyncio.Event = field(default_factory=asyncio.Event)

    def listen(self, bus: Bus) -> None:
        bus.subscribe(self.patrol, Conversation.EVENTS, WaypointReached, self._reached)
        bus.subscribe(self.patrol, Conversation.STATUS, ComponentState, self._said)

    async def begin_anew(self, bus: Bus) -> None:
        """Have the patrol begin from its first way point, wherever the robot is."""
        self.reached.clear()
        await bus.ask(self.patrol, SetParameter("rounds", 0, "the test"), Parameters, within_s=2)

    async def reaches(self, number: int) -> None:
        """Return when this many way points of the patrol were reached."""
        async with asyncio.timeout(number * A_WAY_S):
            while len(self.record()) < number:
                self.changed.clear()
                await self.changed.wait()

    def record(self) -> list[tuple[str, int, int]]:
        """Return robot, number and way point of each visit since the last patrol began."""
        visits = [(visit.robot, visit.number, visit.waypoint) for visit in self.reached]
        begins = [at for at, (_robot, number, _waypoint) in enumerate(visits) if number == 1]
        return visits[begins[-1] :] if begins else []

    async def says(self, begins: str, since_s: float) -> tuple[float, str]:
        """Return when, after a time, the patrol first said something that begins like this, and what."""
        async with asyncio.timeout(WAIT_S):
            while True:
                for at_s, feedback in self.said:
                    if at_s >= since_s and feedback.startswith(begins):
                        return at_s, feedback
                self.changed.clear()
                await self.changed.wait()

    def _reached(self, envelope: Envelope[Any]) -> None:
        self.reached.append(envelope.body)
        self.changed.set()

    def _said(self, envelope: Envelope[Any]) -> None:
        self.said.append((envelope.stamp_s, envelope.body.feedback))
        self.changed.set()


async def counted(bus: Bus, address: str) -> dict[str, float]:
    """Return the statistics of a component."""
    return (await bus.ask(address, AskStatistics(), Statistics, within_s=2)).values


@dataclass
class TakeOvers:
    """A patrol's robot in the hands of two consoles, at random.

    Args:
        low: A console.
        high: One of higher priority.
        watch: Of the patrol.
        dice: Draws console, pauses and wishes.
        wish: Draws what the consoles command.
    """

    low: Console
    high: Console
    watch: Watch
    dice: random.Random
    wish: Callable[[random.Random], DriveWish | MoveWish]
    took: Measured = field(default_factory=Measured)

    async def once(self) -> None:
        """Take the robot over, half of the times from the lower console too; give it back to the patrol."""
        dice, low = self.dice, self.low
        first, wish = dice.choice([low, self.high]), self.wish(dice)
        asked_s = first.clock.now_s()
        self.took.driven.append(await first.take_and_drive(wish))
        _at_s, why = await self.watch.says("suspended", asked_s)
        assert f"higher by {first.name}-" in why, why
        await asyncio.sleep(dice.uniform(0.0, 0.2))
        if first is low and dice.random() < 0.5:
            await self._taken_from_low(wish)
        began_s = await first.give_back(for_good=dice.random() < FOR_GOOD)
        again_s, _said = await self.watch.says("patrols", began_s)
        self.took.resumed.append(again_s - began_s)
        await asyncio.sleep(dice.uniform(0.0, 0.3))

    async def many(self, bus: Bus, cycles: int, visits: int = 1) -> list[tuple[str, int, int]]:
        """Have ``cycles`` take-overs in a patrol that begins anew; return its way points, the same as without them.

        Args:
            bus: Of the onlooker.
            cycles: Number of take-overs.
            visits: The patrol goes on afterwards until it was at this many way points.
        """
        watch = self.watch
        await watch.says("patrols", 0.0)
        await watch.begin_anew(bus)
        before = await counted(bus, watch.patrol)
        for _cycle in range(cycles):
            await self.once()
        await watch.reaches(visits)
        disturbed = watch.record()
        after = await counted(bus, watch.patrol)
        assert after["times_suspended"] - before["times_suspended"] >= cycles
        await watch.begin_anew(bus)
        await watch.reaches(len(disturbed))
        assert disturbed == watch.record()[: len(disturbed)]
        return disturbed

    async def _taken_from_low(self, wish: DriveWish | MoveWish) -> None:
        low, high = self.low, self.high
        mark = len(low.events)
        self.took.driven.append(await high.take_and_drive(wish))
        assert (await low.hears(mark, Suspended)).by.startswith(f"{high.name}-")
        assert low.component is not None
        assert not await low.component.do(wish), "commands of who lost the robot are refused"
        await high.give_back(for_good=self.dice.random() < FOR_GOOD)


def _summary(times_s: list[float]) -> str:
    ordered = sorted(times_s)
    late = ordered[max(0, round(0.99 * len(ordered)) - 1)]
    return (
        f"{len(ordered)} times: {statistics.median(ordered) * 1e3:.0f} ms (median), {late * 1e3:.0f} ms (99 %), "
        f"{ordered[-1] * 1e3:.0f} ms (most)"
    )
