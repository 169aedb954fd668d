"""Long experiment on real processes: the RC manager falls a hundred times in a busy mission.

It measures times, so it wants a machine that does nothing else.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import os
import random
import signal
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import pytest
from running_mission import RunningMission, mission_up, runtime_directory
from slices_of_runs import RCS, WORLD, print_spread

from backbone import run_files
from backbone.addresses import NAMESERVER, RC_MANAGER
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.component.launch import Launch
from backbone.component.messages import AskStatistics, Statistics
from backbone.keys import Conversation
from backbone.nameserver.messages import Appeared, Components, Disappeared, ListComponents
from backbone.naming import Subsystem
from backbone.rc_manager.messages import AskRc, AskSchedule, RcState
from backbone.scheduling.requests import Holder, RequestState
from backbone.scheduling.views import Schedule
from backbone.wire import Envelope
from resource_pool.arc_client import Suspended
from resource_pool.drivers.world_messages import RadioPacket
from scout_model import radio_link
from ui_console.model.driving import DriveWish
from ui_console.model.events import CommandApplied, ConsoleEvent, Granted, said
from ui_console.session.teleoperation import Teleoperation

pytestmark = [pytest.mark.processes, pytest.mark.slow]

KILLS = 100
BACK_WITHIN_S = 2.0
PAUSE_S = (3.1, 3.9)  # chosen: at most 20 falls a minute, which is what a core service is allowed
COMMAND_EVERY_S = 0.15  # chosen: the radio sends each robot's newest command every 0.05 s: each has its turn
ON_AIR_WITHIN_S = 0.5
DRIVER, WAITING = "console-driver", "console-waiting"
NETWORK_ID = 3


class Observed:
    """The mission's publications while its RC manager falls repeatedly."""

    def __init__(self, bus: Bus, clock: MissionClock) -> None:
        self._clock = clock
        self._changed = asyncio.Event()
        self.rc_manager_pid = 0
        self.ready_s = 0.0
        self.schedule: tuple[float, Schedule] | None = None
        self.broken: list[str] = []
        self.packets: dict[tuple[int, bytes], list[float]] = {}
        self._newest: dict[str, int] = {}
        self._of_epoch: dict[tuple[str, int], str] = {}
        bus.subscribe(NAMESERVER, Conversation.EVENTS, Appeared | Disappeared, self._heard_nameserver)
        bus.subscribe(RC_MANAGER, Conversation.SCHEDULE, Schedule, self._heard_schedule)
        bus.subscribe(WORLD, Conversation.COMMAND, RadioPacket, self._heard_packet)
        for rc in RCS:
            bus.subscribe(f"resource_pool/{rc}", Conversation.TELEMETRY, RcState, self._heard_rc)

    async def until(self, holds: Callable[[], bool], within_s: float, what: str) -> None:
        """Return as soon as something heard makes it true."""
        try:
            async with asyncio.timeout(within_s):
                while not holds():
                    self._changed.clear()
                    await self._changed.wait()
        except TimeoutError:
            raise AssertionError(f"not within {within_s} s: {what}") from None

    def judge(self, state: RcState) -> None:
        """Note what no RC may ever say: two holders, or one epoch for two ARCs."""
        if len(state.holders) > 1 and not state.sharable:
            self.broken.append(f"two holders: {state}")
        for holder in state.holders:
            first = self._of_epoch.setdefault((state.name, holder.epoch), holder.arc)
            if first != holder.arc:
                self.broken.append(f"epoch {holder.epoch} of {state.name} was of {first}, is of {holder.arc}")

    def _heard_nameserver(self, envelope: Envelope[Any]) -> None:
        body = envelope.body
        if isinstance(body, Appeared) and body.component.address == RC_MANAGER:
            self.rc_manager_pid, self.ready_s = body.component.pid, self._clock.now_s()
            self._changed.set()

    def _heard_schedule(self, envelope: Envelope[Any]) -> None:
        self.schedule = (self._clock.now_s(), envelope.body)
        self._changed.set()

    def _heard_packet(self, envelope: Envelope[Any]) -> None:
        packet: RadioPacket = envelope.body
        if packet.network_id == NETWORK_ID:
            self.packets.setdefault((packet.epoch, packet.payload), []).append(self._clock.now_s())

    def _heard_rc(self, envelope: Envelope[Any]) -> None:
        """Judge the state; publications of one RC come in order, so its epoch never falls."""
        state: RcState = envelope.body
        self.judge(state)
        newest = self._newest.get(state.name, 0)
        if state.last_epoch < newest:
            self.broken.append(f"the epoch of {state.name} went back from {newest} to {state.last_epoch}")
        self._newest[state.name] = state.last_epoch


@contextlib.asynccontextmanager
async def console(
    mission: RunningMission,
    name: str,
    priority: int,
    work: Callable[[Teleoperation], Any],
) -> AsyncIterator[list[ConsoleEvent]]:
    """Run a console on scout3 inside this process; end it afterwards."""
    with runtime_directory(mission.environment["XDG_RUNTIME_DIR"]):
        found = run_files.find(mission.name)
    clock = MissionClock(found.clock_origin_monotonic_s, found.clock_rate)
    launch = Launch(
        mission.name,
        Subsystem.UI_CONSOLE,
        name,
        "console",
        "ui_console.session.teleoperation:Teleoperation",
        found.host,
        found.endpoint,
        found.clock_origin_monotonic_s,
        found.clock_rate,
        {"robot": "scout3", "kind": "drive", "priority": priority},
    )
    events: list[ConsoleEvent] = []
    own = await ZenohBus.open_when_up(mission.name, launch.address, clock, client_config(found.endpoint))
    running = asyncio.create_task(
        Teleoperation(launch, own, clock, show=events.append, work=work, watches=False).run(), name=name
    )
    try:
        yield events
    finally:
        await asyncio.wait({running}, timeout=20)
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)


@dataclass
class Driven:
    """The commands that were reported as applied to the driving console."""

    over: asyncio.Event = field(default_factory=asyncio.Event)
    granted: asyncio.Event = field(default_factory=asyncio.Event)
    refused: int = 0

    async def work(self, teleoperation: Teleoperation, clock: MissionClock) -> None:
        """Turn on the spot with a speed that is another one each time, until it is over."""
        await teleoperation.wait_granted()
        self.granted.set()
        for number in itertools.count():
            if self.over.is_set():
                break
            speed_rad_s = 1.0 + (number % 4000) * 0.001
            self.refused += not await teleoperation.do(DriveWish(speed_rad_s, -speed_rad_s))
            await clock.sleep_s(COMMAND_EVERY_S)
        await teleoperation.give_back()


async def rc_states(bus: Bus) -> dict[str, RcState]:
    states = await asyncio.gather(*(bus.ask(f"resource_pool/{rc}", AskRc(), RcState, within_s=2) for rc in RCS))
    return {state.name: state for state in states}


def holds_of(states: Mapping[str, RcState], arc: str) -> dict[str, tuple[int, float]]:
    """Return RC → epoch and begin of what the ARC holds."""

    def of(holders: list[Holder]) -> list[Holder]:
        return [holder for holder in holders if holder.arc == arc]

    return {
        rc: (of(state.holders)[0].epoch, of(state.holders)[0].since_s)
        for rc, state in states.items()
        if of(state.holders)
    }


@dataclass
class Fallen:
    """What the falls of the RC manager looked like.

    Attributes:
        ready_s: From each SIGKILL until the nameserver told that a new one is ready.
        known_s: From each SIGKILL until the new one knew all requests.
        unchanged: ARCs that ran across each fall and were compared.
    """

    ready_s: list[float] = field(default_factory=list)
    known_s: list[float] = field(default_factory=list)
    unchanged: list[str] = field(default_factory=list)


async def kill_once(bus: Bus, clock: MissionClock, seen: Observed, fallen: Fallen) -> None:
    """SIGKILL the RC manager, wait for the next one, and compare what ran across it."""
    asking = {"watch-scout1-capture", "watch-scout2-capture", f"{DRIVER}-drive", f"{WAITING}-drive"}
    before = await bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=2)
    held_before = await rc_states(bus)
    fallen_pid = seen.rc_manager_pid
    killed_s = clock.now_s()
    os.kill(fallen_pid, signal.SIGKILL)
    await seen.until(lambda: seen.rc_manager_pid != fallen_pid, 10.0, "a new RC manager is ready")
    fallen.ready_s.append(seen.ready_s - killed_s)

    def all_are_known() -> bool:
        return (
            seen.schedule is not None
            and seen.schedule[0] >= seen.ready_s
            and {request.arc for request in seen.schedule[1].requests} == asking
        )

    await seen.until(all_are_known, 10.0, f"the new RC manager knows {asking}, not {seen.schedule}")
    assert seen.schedule is not None
    fallen.known_s.append(seen.schedule[0] - killed_s)
    held_after = await rc_states(bus)
    compared_s = clock.now_s()
    for state in [*held_before.values(), *held_after.values()]:
        seen.judge(state)
    driver_runs = [request for request in before.requests if request.arc == f"{DRIVER}-drive"]
    assert [request.state for request in driver_runs] == [RequestState.RUNNING]
    for request in before.requests:
        is_due = request.arc != f"{DRIVER}-drive" and request.until_s <= compared_s  # its slice may have ended since
        if request.state is not RequestState.RUNNING or is_due:
            continue
        held = holds_of(held_before, request.arc)
        assert set(held) == set(request.rcs), (request, held_before)
        assert holds_of(held_after, request.arc) == held, f"{request}: {held_after}"
        fallen.unchanged.append(request.arc)


def require_that_all_told_was_sent(events: Sequence[ConsoleEvent], seen: Observed) -> int:
    """Assert that every command reported to the console as applied went over the radio; return how many."""
    applied = [event for event in events if isinstance(event, CommandApplied)]
    for event in applied:
        payload = radio_link.encode_drive(event.values["left_rad_s"], event.values["right_rad_s"])
        sent = seen.packets.get((event.epoch, payload), [])
        assert any(abs(at_s - event.at_s) <= ON_AIR_WITHIN_S for at_s in sent), f"{event} was never sent: {sent}"
    return len(applied)


@pytest.mark.timeout(1200)
async def test_the_rc_manager_falls_a_hundred_times_in_a_busy_mission() -> None:
    """Truth lives at the edge: what runs goes on, what waits waits on, what was said to be applied was."""
    pauses = random.Random(7)
    fallen, driven, stop_waiting = Fallen(), Driven(), asyncio.Event()
    slices_s = {'minimum-runtime-s="5"': 'minimum-runtime-s="2"'}
    with mission_up(change=slices_s) as mission:
        with runtime_directory(mission.environment["XDG_RUNTIME_DIR"]):
            found = run_files.find(mission.name)
        clock = MissionClock(found.clock_origin_monotonic_s, found.clock_rate)

        async def wait(teleoperation: Teleoperation) -> None:
            await stop_waiting.wait()
            await teleoperation.wait_granted()
            await teleoperation.give_back()

        async with (
            mission.bus() as bus,
            console(mission, DRIVER, 100, lambda hands: driven.work(hands, clock)) as driver,
        ):
            seen = Observed(bus, clock)
            there = await bus.ask(NAMESERVER, ListComponents(), Components, within_s=2)
            seen.rc_manager_pid = next(one.pid for one in there.components if one.address == RC_MANAGER)
            await driven.granted.wait()
            async with console(mission, WAITING, 50, wait) as waiting:
                try:
                    await seen.until(
                        lambda: seen.schedule is not None and len(seen.schedule[1].requests) == 4,
                        10.0,
                        "all have asked",
                    )
                    for _kill in range(KILLS):
                        await clock.sleep_s(pauses.uniform(*PAUSE_S))
                        await kill_once(bus, clock, seen, fallen)
                    assert not [event for event in waiting if isinstance(said(event), Granted | Suspended)], waiting
                finally:
                    driven.over.set()
                    stop_waiting.set()
            counts = {
                rc: (await bus.ask(f"resource_pool/{rc}", AskStatistics(), Statistics, within_s=2)).values for rc in RCS
            }
            world = (await bus.ask(WORLD, AskStatistics(), Statistics, within_s=2)).values
        story = mission.story()
    print_spread("ready again", fallen.ready_s)
    print_spread("all requests known", fallen.known_s)
    compared = {arc: fallen.unchanged.count(arc) for arc in sorted(set(fallen.unchanged))}
    sent = require_that_all_told_was_sent(driver, seen)
    print(f"unchanged across falls: {compared}; {sent} commands applied and sent, {driven.refused} refused")
    print(
        {
            rc: {name: values[name] for name in ("applied", "refused_stale", "lease_ends")}
            for rc, values in counts.items()
        }
    )
    assert max(fallen.ready_s) < BACK_WITHIN_S, f"{sorted(fallen.ready_s)}\n{story}"
    assert max(fallen.known_s) < BACK_WITHIN_S, f"{sorted(fallen.known_s)}\n{story}"
    assert compared[f"{DRIVER}-drive"] == KILLS
    assert sum(compared.values()) >= 1.3 * KILLS, compared
    assert not seen.broken, seen.broken
    assert driven.refused == 0, [event for event in driver if not isinstance(event, CommandApplied)]
    assert sum(isinstance(event, Granted) for event in driver) == 1
    assert any(isinstance(event, Granted) for event in waiting)
    assert (world["stale_packets"], world["jammed_frames"]) == (0, 0), world
    assert counts["scout3"]["applied"] >= sent
    assert all(values["refused_stale"] == 0 for values in counts.values()), counts
