"""The law of stops on real consoles: three of them share one robot of the simulated world, and links are cut.

A stopped robot never moves until somebody entitled lifted the stop and a press that began afterwards drives it. What
the radio sends is the witness: each press has wheel speeds of its own.
"""

from __future__ import annotations

import asyncio
import random
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager
from functools import partial
from typing import Any

import pytest
from cut_network import CutNetwork
from pool_on_local_network import Pool, a_pool
from pool_placer import PoolPlacer

from backbone.bus.clock import run_virtual
from backbone.component.launch import Launch
from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed, OperatorAction
from backbone.naming import Subsystem
from backbone.wire import Envelope
from resource_pool.arc_client import StopState, watch_stops
from scout_model.radio_link import encode_drive
from scout_model.scout import wheels_rad_s
from ui_console.model.consent import CONSENT_WITHIN_S
from ui_console.model.console import ConsoleModel
from ui_console.model.driving import STICK_LASTS_S, MoveWish
from ui_console.session.teleoperation import Teleoperation

PEOPLE = ("anna", "ben", "cleo")
RCS = ["scout1", "radio"]
REPEAT_S = 0.05  # keys of a terminal repeat that often
LONGEST_CUT_S = 1.5  # shorter than what ends a link for good
STEPS = 16
OFTEN = {"press": 8, "let go": 8, "lift": 6, "take": 3, "double press": 2, "release": 2}
SELDOM = {"stop": 1, "double stop": 1, "cut": 1}
DOES = [what for what, times in {**OFTEN, **SELDOM}.items() for _time in range(times)]


class Person:
    """A person at a console: held controls, and the content of the screens."""

    def __init__(self, name: str, stage: Stage, *, uses_stick: bool) -> None:
        self.name, self.stage, self.uses_stick = name, stage, uses_stick
        self.model = ConsoleModel(name, name)
        wished = {"robot": "scout1", "kind": "drive", "priority": 100, "minimum_runtime_s": 4.0}
        launch = Launch("local", Subsystem.UI_CONSOLE, name, "console", "x:Y", "local", "", 0.0, 1.0, wished)
        bus = stage.pool.network.join(launch.address, stage.pool.clock)
        self.console = Teleoperation(
            launch, bus, stage.pool.clock, show=self.model.apply, takes=False, keeps_arc=True, user=name
        )
        self.drive: MoveWish | None = None

    async def hands(self) -> None:
        """Repeat the held controls, for ever."""
        while True:
            if self.drive is not None:
                self.console.hold(self.drive, STICK_LASTS_S if self.uses_stick else None)
            await self.stage.pool.clock.sleep_s(REPEAT_S)

    def press(self) -> None:
        if self.drive is None:
            self.drive = self.stage.new_press()

    def let_go(self) -> None:
        self.drive = None
        if self.uses_stick:
            self.console.stop()


class Stage:
    """A pool with three people, and the witness."""

    def __init__(self, pool: Pool, network: CutNetwork, seed: int) -> None:
        self.pool, self.network, self.rng = pool, network, random.Random(seed)
        self.people = [Person(name, self, uses_stick=name == "cleo") for name in PEOPLE]
        self.presses: dict[bytes, float] = {}
        self.stops: list[tuple[float, StopState]] = []
        self.agreed: list[tuple[float, str]] = []
        self.work: set[asyncio.Task[Any]] = set()
        ear = pool.voice_of("mission_control/ear")
        watch_stops(ear, lambda state: self.stops.append((pool.clock.now_s(), state)))
        ear.subscribe("*/*", Conversation.OPERATORS, OperatorActed, self._heard)

    def new_press(self) -> MoveWish:
        """Return speeds that no other press has."""
        number = len(self.presses)
        drive = MoveWish(0.02 + number % 100 / 1000, number // 100 / 20)
        self.presses[encode_drive(*wheels_rad_s(drive.forward_m_s, drive.turn_rad_s))] = self.pool.clock.now_s()
        return drive

    def begin(self, work: Any) -> None:
        task = asyncio.ensure_future(work)
        self.work.add(task)
        task.add_done_callback(self.work.discard)

    def _heard(self, said: Envelope[Any]) -> None:
        if said.body.action is OperatorAction.LET_LIFT:
            self.agreed.append((self.pool.clock.now_s(), said.body.user))

    async def do(self, who: Person, what: str) -> None:
        sleep_s, console = self.pool.clock.sleep_s, who.console
        match what:
            case "press":
                who.press()
            case "let go":
                who.let_go()
            case "double press":
                who.press()
                await sleep_s(REPEAT_S)
                who.let_go()
                await sleep_s(self.rng.choice([REPEAT_S, 0.6]))
                who.press()
            case "stop":
                self.begin(console.stop_all() if self.rng.random() < 0.5 else console.stop_robot("scout1"))
            case "double stop":
                self.begin(console.stop_robot("scout1"))
                await sleep_s(self.rng.uniform(0.0, 0.6))
                self.begin(console.stop_robot("scout1"))
            case "lift":
                stop = who.model.team.robots.stop_of("scout1")
                if stop is not None:
                    self.begin(console.lift_stop("scout1", stop.number))
            case "cut":
                self.network.cut(console.address)
                self.begin(self._heal(console.address))
            case "take":
                console.take()
            case "release":
                console.begin_release()

    async def _heal(self, source: str) -> None:
        await self.pool.clock.sleep_s(self.rng.uniform(0.1, LONGEST_CUT_S))
        self.network.heal(source)

    async def play(self) -> None:
        """One random sequence; afterwards all controls are let go and no console is cut off."""
        for _step in range(STEPS):
            await self.do(self.rng.choice(self.people), self.rng.choice(DOES))
            for who in self.people:
                if self.rng.random() < 0.5:  # nothing, if nobody asks
                    who.console.decide(self.rng.random() < 0.9)
            await self.pool.clock.sleep_s(self.rng.choice([REPEAT_S, 0.3, 0.8]))
        for who in self.people:
            who.let_go()
        while self.work:
            await asyncio.wait(self.work)

    def check(self) -> tuple[int, int]:
        """Check all that was heard; return how many presses drove, and how many of them after a lift."""
        drove: dict[bytes, bool] = {}
        for packet in self.pool.radio_driver.heard_by(1):
            if packet.payload not in self.presses:
                continue
            before = [(at_s, state) for at_s, state in self.stops if at_s < packet.at_s]
            drove[packet.payload] = bool(before)
            if before:
                at_s, state = before[-1]
                assert not state.is_stopped, f"moved at {packet.at_s}, stopped at {at_s} by {state.by}"
                pressed_s = self.presses[packet.payload]
                assert pressed_s >= at_s, f"pressed at {pressed_s}, lifted at {at_s}, moved at {packet.at_s}"
        self._check_lifts()
        assert self.pool.audit["overtaken_packets"] == 0
        return len(drove), sum(drove.values())

    def _check_lifts(self) -> None:
        authors: set[str] = set()
        for at_s, state in self.stops:
            if state.is_stopped:
                authors = {state.by, *(one.by for one in state.also)}
                continue
            longest_s = CONSENT_WITHIN_S + LONGEST_CUT_S + 1.0
            yes = {user for said_s, user in self.agreed if at_s - longest_s <= said_s <= at_s}
            assert authors <= {state.by} | yes, f"{state.by} lifts the stop of {authors}"


@asynccontextmanager
async def a_stage(mission: Any, beside: Any, seed: int) -> AsyncIterator[Stage]:
    network = CutNetwork("local")
    async with a_pool(partial(mission, network=network), RCS) as pool, AsyncExitStack() as stack:
        placer = PoolPlacer(pool)
        stack.push_async_callback(placer.bus.close)
        stage = Stage(pool, network, seed)
        for person in stage.people:
            await stack.enter_async_context(beside(person.console))
            hands = asyncio.create_task(person.hands())
            stack.callback(hands.cancel)
        yield stage
        for who in stage.people:
            who.let_go()


def play(mission: Any, beside: Any, seed: int, sequences: int) -> tuple[int, int]:
    async def main() -> tuple[int, int]:
        async with a_stage(mission, beside, seed) as stage:
            for _sequence in range(sequences):
                await stage.play()
            return stage.check()

    return run_virtual(main())


def test_in_some_random_sequences_no_console_moves_a_stopped_robot(local_mission: Any, beside: Any) -> None:
    drove, drove_after_a_lift = play(local_mission, beside, seed=3, sequences=8)
    assert drove > 3
    assert drove_after_a_lift > 0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_in_two_hundred_random_sequences_no_console_moves_a_stopped_robot(
    local_mission: Any, beside: Any, seed: int
) -> None:
    drove, drove_after_a_lift = play(local_mission, beside, seed=seed, sequences=50)
    assert drove > 20
    assert drove_after_a_lift > 10
