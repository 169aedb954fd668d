"""The life of an offer: what ends what runs on a machine that is offered to a mission elsewhere."""

from __future__ import annotations

import asyncio
import itertools
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import pytest

from backbone.addresses import LAUNCHER
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus, Clock, LinkListener, Subscription
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.command_line.offering import offer_this_machine
from backbone.component.launch import Launch
from backbone.component.messages import Absence, AskState, ComponentState, LifeState, Stop, Stopping
from backbone.component.name_claim import claim_name
from backbone.creator.messages import (
    ListProcesses,
    Processes,
    ProcessFell,
    ProcessState,
    RestartPolicy,
    Spawn,
    creator_name,
    offer_name,
)
from backbone.keys import Conversation
from backbone.launcher import link_speed, mission_recorder
from backbone.launcher import offer as offers
from backbone.launcher.kept_creator import Offered
from backbone.launcher.mission_connection import mission_clock
from backbone.launcher.mission_recorder import MissionRecorder, RecorderFailed
from backbone.launcher.offer import Ending, MachineOffer, Offering
from backbone.naming import Subsystem
from backbone.run_files import RunFolderUnusable
from backbone.wire import Envelope

CUT_OFF_S = 0.5
WITHIN_S = 5.0


class BusOnACable(LocalBus):
    """A bus whose link the test cuts and heals."""

    def __init__(self, network: LocalNetwork, source: str, clock: Clock) -> None:
        super().__init__(network, source, clock)
        self.link_changed: LinkListener = lambda _up: None

    def watch_link(self, listener: LinkListener) -> Subscription:
        self.link_changed = listener
        listener(True)
        return super().watch_link(lambda _up: None)


@dataclass
class FakeCreator:
    """Keeps nothing, and notes its calls."""

    on_fell: Callable[[ProcessFell], None] = lambda _fell: None
    runs: bool = False
    never_ready: bool = False
    log: list[str] = field(default_factory=list)
    missing: list[Absence] = field(default_factory=list)
    on_changed: Callable[[], None] = lambda: None
    began: asyncio.Event = field(default_factory=asyncio.Event)
    folder_removed: asyncio.Event = field(default_factory=asyncio.Event)

    async def start(self, bus: Bus, clock: Clock) -> None:
        self.began.set()
        if self.never_ready:
            await asyncio.get_running_loop().create_future()
        self.runs = True
        self.log.append("started")

    def processes(self) -> list[ProcessState]:
        order = Spawn(Subsystem.BACKBONE, creator_name("far"), "creator", "x:Y", policy=RestartPolicy())
        return [ProcessState(order, 1, 0, "")]

    def absences(self) -> list[Absence]:
        return self.missing

    async def wait_folder_removed(self, clock: Clock) -> None:
        await self.folder_removed.wait()

    async def close(self) -> None:
        self.runs = False
        self.log.append("closed")


@dataclass
class Scene:
    """An offer that lives, its creator, and the link to cut."""

    offer: MachineOffer
    creator: FakeCreator
    bus: BusOnACable
    tester: Bus
    tester_clock: Clock
    life: asyncio.Task[None]

    async def ends(self) -> Ending:
        await asyncio.wait_for(self.life, WITHIN_S)
        return self.offer.ending


@pytest.fixture
def on_a_cable(local_mission: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    monkeypatch.setattr(offers, "CUT_OFF_S", CUT_OFF_S)

    @asynccontextmanager
    async def scene(creator: FakeCreator | None = None, *, behind_s: float = 0.0, **more: Any) -> AsyncIterator[Scene]:
        clock = MissionClock.started_now()
        async with local_mission(clock=clock) as network:
            own = MissionClock(clock.origin_monotonic_s + behind_s)
            launch = Launch(
                "local", Subsystem.BACKBONE, offer_name("far"), "offer", "", "far", "", own.origin_monotonic_s, 1.0
            )
            ready = asyncio.Event()
            bus, kept = BusOnACable(network, launch.address, own), creator or FakeCreator()
            tester = network.join("ui_console/tester", clock)
            it = MachineOffer(launch, bus, own, kept, ready.set, **more)
            life = asyncio.create_task(it.run())
            if not kept.never_ready:
                await asyncio.wait_for(ready.wait(), WITHIN_S)
            yield Scene(it, kept, bus, tester, clock, life)
            it.end("the test is over")
            await life
            await tester.close()

    return scene


async def test_a_link_that_stays_down_ends_what_runs_here(on_a_cable: Callable[..., Any]) -> None:
    async with on_a_cable() as scene:
        scene.bus.link_changed(False)
        assert await scene.ends() is Ending.CUT_OFF
        assert scene.creator.log == ["started", "closed"]


async def test_a_link_that_is_soon_back_ends_nothing(on_a_cable: Callable[..., Any]) -> None:
    async with on_a_cable() as scene:
        for _ in range(5):
            scene.bus.link_changed(False)
            await asyncio.sleep(CUT_OFF_S / 5)
            scene.bus.link_changed(True)
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(asyncio.shield(scene.life), 2 * CUT_OFF_S)
        assert scene.creator.runs


@pytest.mark.parametrize("pause_s", [0.0, CUT_OFF_S / 5])
async def test_a_link_that_is_back_after_a_sleep_of_the_machine_ends_what_runs_here(
    on_a_cable: Callable[..., Any], pause_s: float
) -> None:
    async with on_a_cable(behind_s=60.0) as scene:
        scene.bus.link_changed(False)
        if pause_s:
            await asyncio.sleep(pause_s)
        scene.bus.link_changed(True)
        assert await scene.ends() is Ending.OTHER_TIME
        assert not scene.creator.runs


@pytest.mark.parametrize(
    ("behind_s", "told"), [(0.1, ""), (2.0, "2.0 s behind the mission's"), (-2.0, "2.0 s ahead of the mission's")]
)
async def test_a_machine_whose_clock_has_drifted_says_so(
    on_a_cable: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, behind_s: float, told: str
) -> None:
    compared, times = asyncio.Event(), itertools.count(1)

    async def reading(bus: Bus) -> MissionClock:
        if next(times) > 1:
            compared.set()
        return await mission_clock(bus)

    monkeypatch.setattr(offers, "COMPARE_EACH_S", 0.01)
    monkeypatch.setattr(offers, "mission_clock", reading)
    async with on_a_cable(behind_s=behind_s) as scene:
        await asyncio.wait_for(compared.wait(), WITHIN_S)
        state = await scene.tester.ask(scene.offer.address, AskState(), ComponentState, within_s=1.0)
        assert [one.name for one in state.absent] == (["far"] if told else [])
        assert all(told in one.cause and "Ctrl-C" in one.remedy for one in state.absent)
        assert scene.creator.runs


async def test_a_machine_with_a_slow_link_says_so(
    on_a_cable: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(offers, "MEASURE_EACH_S", 0.01)
    monkeypatch.setattr(link_speed, "SLOW_S", 0.0)
    said = asyncio.Queue[Absence]()

    def hear(heard: Envelope[ComponentState]) -> None:
        for absence in heard.body.absent:
            said.put_nowait(absence)

    async with on_a_cable() as scene:
        scene.tester.subscribe(scene.offer.address, Conversation.STATUS, ComponentState, hear)
        absence = await asyncio.wait_for(said.get(), WITHIN_S)
        assert (absence.name, absence.is_running) == ("far", True)
        assert "a round trip to the hub takes" in absence.cause
        assert scene.creator.runs


@pytest.mark.parametrize("pids_between", [1, 0], ids=["another pid", "equal pids, as in containers"])
async def test_a_machine_whose_name_was_given_away_while_it_was_cut_off_ends_what_runs_here(
    on_a_cable: Callable[..., Any], pids_between: int
) -> None:
    async with on_a_cable() as scene:
        for tokens in list(scene.bus.network.tokens.values()):
            for token in [token for token in tokens if token.owner is scene.bus]:
                token.close()
        own = scene.offer.component_state()
        other = msgspec.structs.replace(own, pid=own.pid + pids_between, start=own.start - 1)
        await claim_name(scene.tester, scene.tester_clock, other)
        scene.bus.link_changed(False)
        scene.bus.link_changed(True)
        assert await scene.ends() is Ending.REPLACED
        assert not scene.creator.runs


async def test_a_folder_that_is_removed_ends_what_runs_here(on_a_cable: Callable[..., Any]) -> None:
    async with on_a_cable() as scene:
        scene.creator.folder_removed.set()
        assert await scene.ends() is Ending.NO_FOLDER
        assert scene.creator.log == ["started", "closed"]


async def test_a_link_that_is_lost_before_the_creator_is_ready_ends_the_wait(on_a_cable: Callable[..., Any]) -> None:
    async with on_a_cable(FakeCreator(never_ready=True)) as scene:
        await asyncio.wait_for(scene.creator.began.wait(), WITHIN_S)
        scene.bus.link_changed(False)
        assert await scene.ends() is Ending.CUT_OFF


@pytest.mark.processes
async def test_a_machine_whose_recorder_does_not_begin_in_time_is_offered_and_recorded_later(
    on_a_cable: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script, begins, said, goes_on = tmp_path / "recorder", tmp_path / "begins", list[str](), asyncio.Event()

    def say(line: str) -> None:
        said.append(line)
        if line == "the recording goes on":
            goes_on.set()

    script.write_text(f"#!/bin/sh\ntest -e {begins} && echo records to far.mcap >&2\nexec sleep 60\n")
    script.chmod(0o700)
    monkeypatch.setattr(sys, "executable", str(script))
    monkeypatch.setattr(mission_recorder, "BEGUN_WITHIN_S", 0.3)
    monkeypatch.setattr(mission_recorder, "AGAIN_AFTER_S", 0.05)
    recorder = MissionRecorder("night", tmp_path / "far.mcap", MissionClock.started_now(), [])
    try:
        async with on_a_cable(recorder=recorder, say=say) as scene:
            assert scene.creator.runs
            [line] = said
            assert line.startswith("lost its recorder: the recorder did not begin: it did not begin within 0.3 s")
            state = await scene.tester.ask(scene.offer.address, AskState(), ComponentState, within_s=WITHIN_S)
            assert [absence.name for absence in state.absent] == ["recorder"]
            begins.touch()
            await asyncio.wait_for(goes_on.wait(), WITHIN_S)
            assert recorder.absence() is None
    finally:
        await recorder.end()


async def test_a_machine_whose_recording_cannot_be_written_is_not_offered(tmp_path: Path) -> None:
    with pytest.raises(RecorderFailed, match="there is no folder"):
        await offer_this_machine("night", "unixsock-stream/nowhere", None, "far", (), tmp_path / "no" / "far.mcap")


async def test_the_launcher_ends_it_and_its_token_falls_when_nothing_runs_here(on_a_cable: Callable[..., Any]) -> None:
    async with on_a_cable() as scene:
        ran_at_the_fall: list[bool] = []
        fallen = asyncio.Event()

        def changed(_address: str, stands: bool) -> None:
            if not stands:
                ran_at_the_fall.append(scene.creator.runs)
                fallen.set()

        scene.tester.watch_alive("backbone/offer-far", changed)
        listed = await scene.tester.ask("backbone/offer-far", ListProcesses(), Processes, within_s=WITHIN_S)
        assert [process.spawn.name for process in listed.processes] == ["creator-far"]
        await scene.tester.ask("backbone/offer-far", Stop("the mission ends"), Stopping, within_s=WITHIN_S)
        assert await scene.ends() is Ending.ORDERED
        await asyncio.wait_for(fallen.wait(), WITHIN_S)
        assert ran_at_the_fall == [False]


async def test_a_creator_that_falls_is_absent_until_it_is_back_and_ends_nothing(on_a_cable: Callable[..., Any]) -> None:
    async with on_a_cable() as scene:
        scene.creator.missing = [Absence("creator-far", 1.0, "killed by SIGKILL", "restarts in 0.1 s")]
        scene.creator.on_fell(ProcessFell("creator-far", "killed by SIGKILL", 0.1, []))
        state = await scene.tester.ask("backbone/offer-far", AskState(), ComponentState, within_s=WITHIN_S)
        assert [absence.name for absence in state.absent] == ["creator-far"]
        assert not scene.life.done()


async def test_a_machine_whose_folder_cannot_be_made_keeps_no_bus_open(monkeypatch: pytest.MonkeyPatch) -> None:
    network, opened = LocalNetwork("night"), list[LocalBus]()

    async def clock_there(*_where: object) -> MissionClock:
        return MissionClock.started_now()

    class Opening:
        @staticmethod
        async def open_when_up(_mission: str, source: str, clock: Clock, _config: object) -> LocalBus:
            opened.append(network.join(source, clock))
            return opened[-1]

    def refuse(*_given: object) -> None:
        raise RunFolderUnusable("the disc is full")

    for name, fake in [("clock_elsewhere", clock_there), ("ZenohBus", Opening), ("recorder_of_host", refuse)]:
        monkeypatch.setattr(offers, name, fake)
    offering = Offering(Offered("night", "unixsock-stream/nowhere", "far", record=Path("far.mcap")), print)
    with pytest.raises(RunFolderUnusable):
        await offering.run()
    assert [one.source for one in opened if not one.closed] == []


@pytest.mark.parametrize("ends_meanwhile", [True, False], ids=["it ends later", "it is ending already"])
async def test_an_offer_whose_name_is_taken_ends_with_the_mission(
    local_mission: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, ends_meanwhile: bool
) -> None:
    """The launcher asks only the offer that has the name to end."""
    clock, opened, said = MissionClock.started_now(), list[BusOnACable](), asyncio.Queue[str]()
    launcher = ComponentState(LAUNCHER, "launcher", "base", 1, LifeState.READY, 1)

    async def clock_there(*_where: object) -> MissionClock:
        return clock

    async with local_mission(clock=clock) as network:

        class Opening:
            @staticmethod
            async def open_when_up(_mission: str, source: str, clock: Clock, _config: object) -> LocalBus:
                opened.append(BusOnACable(network, source, clock))
                return opened[-1]

        @asynccontextmanager
        async def connected(_mission: str, _endpoint: str, source: str, _secret: str) -> AsyncIterator[Any]:
            bus = network.join(source, clock)
            yield bus, clock
            await bus.close()

        async def answer(_asked: Envelope[Any]) -> ComponentState:
            return launcher

        fakes = {"clock_elsewhere": clock_there, "ZenohBus": Opening, "connected": connected}
        for name, fake in {**fakes, "KeptCreator": lambda *_given: FakeCreator()}.items():
            monkeypatch.setattr(offers, name, fake)
        there = network.join(LAUNCHER, clock)
        there.serve(LAUNCHER, AskState, answer)
        offering = Offering(Offered("local", "unixsock-stream/nowhere", "far"), said.put_nowait)
        life = asyncio.create_task(offering.run())
        async with asyncio.timeout(WITHIN_S):
            assert await said.get() == "far is in mission local"
            own = await there.ask(f"backbone/{offer_name('far')}", AskState(), ComponentState, within_s=WITHIN_S)
            for tokens in list(network.tokens.values()):
                for token in [token for token in tokens if token.owner is opened[0]]:
                    token.close()
            await claim_name(there, clock, msgspec.structs.replace(own, start=own.start - 1))
            ending = msgspec.structs.replace(launcher, state=LifeState.DRAINING)
            launcher = launcher if ends_meanwhile else ending
            opened[0].link_changed(False)
            opened[0].link_changed(True)
            assert (await said.get()).startswith(Ending.REPLACED)
            assert "trying again" in await said.get()
            while ends_meanwhile and not life.done():
                there.publish(LAUNCHER, Conversation.STATUS, ending)
                await asyncio.sleep(0.02)
            await life
            assert await said.get() == "mission local ends"
        await there.close()
