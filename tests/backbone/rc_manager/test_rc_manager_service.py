"""The RC manager's loop on the local bus: what it does to RCs and ARCs, and that it survives its own end."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import pytest
from trace_checker import check

from backbone.addresses import PLACER, RC_MANAGER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component.messages import NameTaken
from backbone.dependency_database.messages import Resource
from backbone.dependency_database.service import DependencyDatabase
from backbone.keys import Conversation
from backbone.naming import Subsystem
from backbone.placer.messages import Start
from backbone.rc_manager.messages import (
    BEAT_WITHIN_S,
    AskRc,
    AskRequest,
    AskSchedule,
    AskUtilization,
    AskWhy,
    Beat,
    CloseGate,
    Connect,
    Connected,
    CurrentRequest,
    Disconnect,
    Disconnected,
    Done,
    GateClosed,
    GateOpens,
    Held,
    OpenGate,
    RcState,
    SetIdle,
    SetPriority,
    StaleEpoch,
    Withdraw,
)
from backbone.rc_manager.service import RcManager
from backbone.scheduling.requests import (
    LEASE_S,
    CapacityExceeded,
    Holder,
    PathNode,
    RcUse,
    RequestState,
    Scheduled,
    SchedulingRequest,
    UnknownRc,
    UnknownRequest,
    Usage,
)
from backbone.scheduling.views import Schedule, Utilization, Why
from backbone.wire import Envelope, Message

HARDWARE = [
    Resource("left", "scout"),
    Resource("right", "scout"),
    Resource("video", "video_frequency", connect_s=0.3),
    Resource("radio", "command_radio", sharable=True),
]


class PlainRc(Component[Any]):
    """An RC that keeps the rules to the letter and reports violations of others."""

    accepts = Connect | Disconnect | AskRc
    sharable = False

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.holders: dict[str, int] = {}
        self.last_epoch = 0
        self.log: list[tuple[str, str]] = []
        self.hangs = False
        self.tells: Callable[[RcState], RcState] = lambda state: state

    async def answer(self, asked: Envelope[Any]) -> Message:
        if self.hangs:
            await self.clock.sleep_s(60.0)
        match asked.body:
            case Connect(arc=arc, epoch=epoch):
                if epoch <= self.last_epoch:
                    raise StaleEpoch(f"{epoch} after {self.last_epoch}")
                if self.holders and not self.sharable:
                    raise Held(f"{self.name} is held by {self.holders}")
                self.last_epoch = epoch
                self.holders[arc] = epoch
                self.log.append(("connect", arc))
                return Connected(epoch)
            case Disconnect(arc=arc):
                self.holders.pop(arc, None)
                self.log.append(("disconnect", arc))
                return Disconnected(self.last_epoch)
            case AskRc():
                holders = [Holder(arc, epoch, 0.0, 0.0) for arc, epoch in self.holders.items()]
                return self.tells(
                    RcState(self.name, self.launch.type, self.sharable, 1.0, holders, self.last_epoch, 0, 0)
                )
        return await super().answer(asked)


class PlainArc(Component[Any]):
    """An ARC that opens and closes on order."""

    accepts = OpenGate | CloseGate | AskRequest

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.epochs: dict[str, int] = {}
        self.granted_s = -1.0
        self.request: SchedulingRequest | None = None
        self.rcs: list[str] = []
        self.log: list[tuple[str, str, float]] = []
        self.beats = True
        self.hangs = False

    async def serve(self) -> None:
        while True:
            if self.beats:
                self.bus.publish(self.address, Conversation.BEAT, Beat(self.name))
            await self.clock.sleep_s(BEAT_WITHIN_S)

    async def ask_for(self, request: SchedulingRequest) -> Scheduled:
        self.request = request
        scheduled = await self.bus.ask(RC_MANAGER, request, Scheduled, within_s=30)
        self.rcs = scheduled.rcs
        return scheduled

    async def answer(self, asked: Envelope[Any]) -> Message:
        if self.hangs:
            await self.clock.sleep_s(60.0)
        match asked.body:
            case OpenGate(epochs=epochs, settled_s=settled_s):
                await self.clock.sleep_until_s(settled_s)
                self.epochs, self.granted_s = epochs, self.clock.now_s()
                self.log.append(("open", "", self.clock.now_s()))
                return GateOpens()
            case CloseGate(reason=reason, by=by):
                self.epochs, self.granted_s = {}, -1.0
                self.log.append((reason, by, self.clock.now_s()))
                return GateClosed()
            case AskRequest():
                if self.request is None:
                    raise UnknownRequest(f"{self.name} asked for nothing yet")
                return CurrentRequest(self.request, self.rcs, self.epochs, self.granted_s)
        return await super().answer(asked)

    @property
    def is_open(self) -> bool:
        return bool(self.epochs)


@dataclass
class Pool:
    """A network with hardware, an RC manager that can be killed, and ARCs."""

    network: LocalNetwork
    clock: VirtualClock
    beside: Callable[[Component[Any]], AbstractAsyncContextManager[Component[Any]]]
    stack: AsyncExitStack
    trace: Path
    rcs: dict[str, PlainRc] = field(default_factory=dict)

    def launch(self, subsystem: Subsystem, name: str, kind: str, parameters: dict[str, Any] | None = None) -> Launch:
        return Launch("local", subsystem, name, kind, "x:Y", "here", "", 0.0, 1.0, parameters or {})

    async def arc(self, name: str) -> PlainArc:
        launch = self.launch(Subsystem.RESOURCE_POOL, name, "plain_arc")
        arc = PlainArc(launch, self.network.join(launch.address, self.clock), self.clock)
        await self.stack.enter_async_context(self.beside(arc))
        return arc

    async def rc(self, resource: Resource) -> PlainRc:
        launch = self.launch(Subsystem.RESOURCE_POOL, resource.name, resource.type)
        rc = PlainRc(launch, self.network.join(launch.address, self.clock), self.clock)
        rc.sharable = resource.sharable
        await self.stack.enter_async_context(self.beside(rc))
        self.rcs[resource.name] = rc
        return rc

    def manager(self) -> RcManager:
        parameters = {"mission": "local", "mission_priority": 10, "trace": str(self.trace)}
        launch = self.launch(Subsystem.BACKBONE, "rc_manager", "rc_manager", parameters)
        return RcManager(launch, self.network.join(launch.address, self.clock), self.clock)


def request(arc: str, *rcs: str, priority: int | None = None, minimum_runtime_s: float = 5.0) -> SchedulingRequest:
    """Ask as a behavior, or with a priority as a console."""
    uses = {rc: RcUse([Usage(0.05, 0.002)]) if rc == "radio" else RcUse() for rc in rcs}
    path = (
        [PathNode("local", 10), PathNode(f"owner-{arc}", 1)]
        if priority is None
        else [PathNode(f"console-{arc}", priority)]
    )
    return SchedulingRequest(arc, f"mission_control/owner-{arc}", path, priority is not None, [uses], minimum_runtime_s)


@asynccontextmanager
async def a_pool(local_mission: Any, beside: Any, trace: Path) -> AsyncIterator[Pool]:
    clock = VirtualClock()
    async with local_mission() as network, AsyncExitStack() as stack:
        pool = Pool(network, clock, beside, stack, trace)
        resources = [msgspec.to_builtins(resource) for resource in HARDWARE]
        launch = pool.launch(Subsystem.BACKBONE, "dependency_database", "dependency_database", {"resources": resources})
        await stack.enter_async_context(beside(DependencyDatabase(launch, network.join(launch.address, clock), clock)))
        for resource in HARDWARE:
            await pool.rc(resource)
        yield pool


@pytest.fixture
def pool(local_mission: Any, beside: Any, tmp_path: Path) -> Callable[[], AbstractAsyncContextManager[Pool]]:
    return lambda: a_pool(local_mission, beside, tmp_path / "trace.jsonl")


def test_two_equals_share_a_frequency_five_seconds_each(pool: Any) -> None:
    """RAM 2002: two Scouts, one video frequency, 5 s each, round robin."""

    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one, two = await here.arc("one"), await here.arc("two")
            first = await one.ask_for(request("one", "left", "video", "radio"))
            second = await two.ask_for(request("two", "right", "video", "radio"))
            assert first.state is RequestState.CONNECTING
            assert (second.state, second.blockers) == (RequestState.WAITING, ["one"])
            await here.clock.sleep_until_s(26.0)
            opens = sorted((at, arc.name) for arc in (one, two) for what, _, at in arc.log if what == "open")
            assert [name for _, name in opens] == ["one", "two"] * 2 + ["one"]
            gaps = [later - earlier for (earlier, _), (later, _) in pairwise(opens)]
            assert all(5.3 - 1e-6 <= gap <= 5.4 for gap in gaps), gaps
            assert next(by for what, by, _ in one.log if what == "slice") == "two"

    run_virtual(main())


def test_the_utilization_of_each_rc_and_the_shares_before_and_after_a_re_planning_can_be_asked(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            behavior, console = await here.arc("behavior"), await here.arc("console")
            await here.clock.sleep_s(10.0 - here.clock.now_s())
            await behavior.ask_for(request("behavior", "left", "radio"))
            await here.clock.sleep_s(10.0)
            await console.ask_for(request("console", "left", "radio", priority=100))
            await here.clock.sleep_s(20.0)
            answer = await console.bus.ask(RC_MANAGER, AskUtilization(periods=True), Utilization, within_s=1)
            found = {one.rc: one for one in answer.rcs}
            assert found["left"].minute == pytest.approx(30 / 40, abs=0.01)
            assert found["radio"].ten_minutes == pytest.approx(30 / 40 * 0.04, abs=0.001)
            assert found["right"].minute == 0.0
            before, after = found["left"].periods[-2:]
            assert (before.because, before.shares) == ("behavior asks", {"behavior": pytest.approx(1.0, abs=0.01)})
            assert (after.because, after.shares["console"]) == ("console asks", pytest.approx(1.0, abs=0.01))
            briefly = await console.bus.ask(RC_MANAGER, AskUtilization(), Utilization, within_s=1)
            assert all(one.periods == [] for one in briefly.rcs)

    run_virtual(main())


def test_a_console_of_higher_priority_overrides_at_once_and_the_behavior_comes_back(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            behavior, console = await here.arc("behavior"), await here.arc("console")
            await behavior.ask_for(request("behavior", "left", "radio"))
            await here.clock.sleep_s(1.0)
            asked_s = here.clock.now_s()
            await console.ask_for(request("console", "left", "radio", priority=100))
            await here.clock.sleep_s(0.05)
            assert console.is_open
            assert not behavior.is_open
            assert console.granted_s - asked_s < 0.05
            assert behavior.log[-1][:2] == ("higher", "console")
            await console.bus.ask(RC_MANAGER, Withdraw("console", "self"), Done, within_s=1)
            await here.clock.sleep_s(0.05)
            assert behavior.is_open

    run_virtual(main())


def test_the_death_of_an_arc_frees_its_rcs(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            waiting = await here.arc("waiting")
            launch = here.launch(Subsystem.RESOURCE_POOL, "dying", "plain_arc")
            dying = PlainArc(launch, here.network.join(launch.address, here.clock), here.clock)
            async with here.beside(dying):
                await dying.ask_for(request("dying", "left", "radio"))
                await waiting.ask_for(request("waiting", "left", "radio"))
                await here.clock.sleep_s(1.0)
                assert dying.is_open
            await here.clock.sleep_s(0.5)
            assert waiting.is_open
            assert set(here.rcs["left"].holders) == {"waiting"}

    run_virtual(main())


def test_an_arc_that_no_longer_beats_loses_its_rcs(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            hung, waiting = await here.arc("hung"), await here.arc("waiting")
            await hung.ask_for(request("hung", "left", "radio", minimum_runtime_s=60.0))
            await waiting.ask_for(request("waiting", "left", "radio"))
            await here.clock.sleep_s(1.0)
            hung.beats = False
            await here.clock.sleep_s(3.0)
            assert waiting.is_open

    run_virtual(main())


def test_an_rc_that_dies_takes_only_its_own_arc_along(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one, two = await here.arc("one"), await here.arc("two")
            await one.ask_for(request("one", "left", "radio"))
            await two.ask_for(request("two", "right", "radio"))
            await here.clock.sleep_s(0.5)
            assert one.is_open
            assert two.is_open
            here.rcs["left"].end("it is killed")
            await here.clock.sleep_s(3.0)
            assert not one.is_open
            assert one.log[-1][0] == "rc"
            assert two.is_open
            await here.rc(HARDWARE[0])
            await here.clock.sleep_s(0.5)
            assert one.is_open

    run_virtual(main())


def test_an_rc_that_does_not_confirm_counts_as_held_until_its_lease_is_over(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one, two = await here.arc("one"), await here.arc("two")
            await one.ask_for(request("one", "left", "radio"))
            await here.clock.sleep_s(1.0)
            here.rcs["left"].hangs = True
            asked_s = here.clock.now_s()
            await two.ask_for(request("two", "radio", "left", priority=100))
            await here.clock.sleep_s(LEASE_S - 0.1)
            assert not one.is_open
            assert not two.is_open
            await here.clock.sleep_s(0.2)
            here.rcs["left"].hangs = False
            here.rcs["left"].holders.clear()
            await here.clock.sleep_s(2.0)
            assert two.is_open
            assert two.granted_s >= asked_s + LEASE_S - 1e-6

    run_virtual(main())


def test_an_arc_that_hangs_delays_nobody(pool: Any) -> None:
    """Its epochs are over as soon as its RCs have disconnected."""

    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one, two = await here.arc("one"), await here.arc("two")
            await one.ask_for(request("one", "left", "radio"))
            await here.clock.sleep_s(1.0)
            one.hangs = True
            asked_s = here.clock.now_s()
            await two.ask_for(request("two", "radio", "left", priority=100))
            await here.clock.sleep_s(1.5)
            assert two.is_open
            assert two.granted_s - asked_s < 0.25  # the grace of 0.2 s, and the time of the messages

    run_virtual(main())


def test_an_rc_that_was_away_is_free_as_soon_as_it_says_so_itself(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one = await here.arc("one")
            await one.ask_for(request("one", "left", "radio"))
            await here.clock.sleep_s(1.0)
            here.rcs["left"].end("it is killed")
            await here.clock.sleep_s(0.3)
            assert not one.is_open
            came_back_s = here.clock.now_s()
            await here.rc(HARDWARE[0])
            await here.clock.sleep_s(LEASE_S)
            assert one.is_open
            assert one.granted_s - came_back_s < 0.3  # and not only when the lease of its earlier life is over

    run_virtual(main())


def test_the_other_rcs_of_an_arc_do_not_wait_for_one_that_died(pool: Any) -> None:
    """Its successor confirms instead, before it is counted as up."""

    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one, two = await here.arc("one"), await here.arc("two")
            await one.ask_for(request("one", "left", "video"))
            await two.ask_for(request("two", "right", "video"))
            await here.clock.sleep_s(1.0)
            assert one.is_open
            here.rcs["left"].end("it is killed")
            await here.clock.sleep_s(0.3 + 0.2)
            assert two.is_open
            successor = await here.rc(HARDWARE[0])
            await here.clock.sleep_s(6.0)
            assert one.is_open
            assert successor.log == [("disconnect", "one"), ("connect", "one")]

    run_virtual(main())


def test_an_rc_that_does_not_confirm_in_time_and_has_no_other_holder_is_down_until_it_does(pool: Any) -> None:
    async def main() -> Path:
        async with pool() as here, here.beside(here.manager()):
            one = await here.arc("one")
            await one.ask_for(request("one", "left", "radio"))
            await here.clock.sleep_s(1.0)
            here.rcs["left"].hangs = True
            await one.bus.ask(RC_MANAGER, SetIdle("one", True), Done, within_s=1)
            await here.clock.sleep_s(LEASE_S + 0.1)
            here.rcs["left"].hangs = False
            await here.clock.sleep_s(LEASE_S)
            return here.trace  # type: ignore[no-any-return]

    lines = [json.loads(line) for line in run_virtual(main()).read_text().splitlines()]
    ended = next(number for number, line in enumerate(lines) if line["ev"] == "revoke")
    told = [line for line in lines[ended:] if line.get("id") == "left" or line.get("arc") == "one"]
    assert [line.get("state", line["ev"]) for line in told] == ["revoke", "down", "free", "up"]
    assert told[2]["t"] - told[0]["t"] <= 0.2 + 0.05  # grace and tolerance
    assert check(lines) == []


def test_a_set_that_cannot_be_connected_whole_is_given_back_whole(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            here.rcs["video"].holders["somebody else"] = 1
            one = await here.arc("one")
            await one.ask_for(request("one", "left", "video", "radio"))
            await here.clock.sleep_s(0.1)
            assert not one.is_open
            assert here.rcs["left"].log[:2] == [("connect", "one"), ("disconnect", "one")]
            assert here.rcs["left"].holders == {}
            here.rcs["video"].holders.clear()
            await here.clock.sleep_s(1.0)
            assert one.is_open

    run_virtual(main())


def test_a_restarted_rc_manager_adopts_the_running_arc_and_remembers_the_waiting_one(pool: Any) -> None:
    """ARCHITECTURE, rule 5: truth lives at the edge."""

    async def main() -> None:
        async with pool() as here:
            one, two = await here.arc("one"), await here.arc("two")
            async with here.beside(here.manager()):
                await one.ask_for(request("one", "left", "video", "radio"))
                await two.ask_for(request("two", "right", "video", "radio"))
                await here.clock.sleep_s(2.0)
                assert one.is_open
                epochs = dict(one.epochs)
            async with here.beside(here.manager()):
                await here.clock.sleep_s(0.5)
                assert one.epochs == epochs
                assert [what for what, *_ in one.log] == ["open"]
                await here.clock.sleep_s(5.0)
                assert two.is_open
                assert min(two.epochs.values()) > 0
            assert here.rcs["video"].log[:2] == [("connect", "one"), ("disconnect", "one")]

    run_virtual(main())


def test_the_trace_after_a_restart_shows_the_slice_that_goes_on_as_it_was(pool: Any) -> None:
    """Its RCs settled and its slice began before the restart: nothing was granted now, nothing unsettled."""

    async def main() -> tuple[Path, float]:
        async with pool() as here:
            one, two = await here.arc("one"), await here.arc("two")
            async with here.beside(here.manager()):
                await one.ask_for(request("one", "left", "video", "radio"))
                await two.ask_for(request("two", "right", "video", "radio"))
                await here.clock.sleep_s(2.0)
            granted_s = one.granted_s
            async with here.beside(here.manager()):
                await here.clock.sleep_s(8.0)
            return here.trace, granted_s

    trace, granted_s = run_virtual(main())
    lines = [json.loads(line) for line in trace.read_text().splitlines()]
    lines = lines[[line["ev"] for line in lines].index("meta", 1) :]
    grant = next(line for line in lines if line["ev"] == "grant")
    assert (grant["arc"], grant["t"]) == ("one", pytest.approx(granted_s))
    assert [line["arc"] for line in lines if line["ev"] == "grant"] == ["one", "two"]
    assert check(lines) == []


def test_a_restarted_rc_manager_frees_what_a_dead_arc_left_held(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here:
            here.rcs["left"].holders["ghost"] = 7
            here.rcs["left"].last_epoch = 7
            async with here.beside(here.manager()):
                one = await here.arc("one")
                await one.ask_for(request("one", "left", "radio"))
                await here.clock.sleep_s(0.2)
                assert one.is_open
                assert one.epochs["left"] > 7

    run_virtual(main())


def test_impossible_requests_are_refused_with_their_numbers(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one = await here.arc("one")
            with pytest.raises(UnknownRc):
                await one.ask_for(request("one", "nothing"))
            greedy = msgspec.structs.replace(
                request("one", "left"), alternatives=[{"radio": RcUse([Usage(0.01, 0.02)])}]
            )
            with pytest.raises(CapacityExceeded) as refused:
                await one.ask_for(greedy)
            assert refused.value.facts["demanded"] == pytest.approx(2.0)
            found = await one.bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=1)
            assert found.requests == []

    run_virtual(main())


def test_why_names_the_blocker_and_a_changed_priority_plans_anew(pool: Any) -> None:
    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            one, two = await here.arc("one"), await here.arc("two")
            await one.ask_for(request("one", "left", "radio", minimum_runtime_s=60.0))
            await two.ask_for(request("two", "left", "radio"))
            await here.clock.sleep_s(1.0)
            why = await two.bus.ask(RC_MANAGER, AskWhy("two"), Why, within_s=1)
            assert (why.state, why.blockers) == ("waiting", ["one"])
            await two.bus.ask(RC_MANAGER, SetPriority("owner-two", 5), Done, within_s=1)
            await here.clock.sleep_s(0.1)
            assert two.is_open

    run_virtual(main())


@pytest.mark.parametrize(("arcs", "most"), [(2, 160), (40, 40)])
def test_the_more_arcs_there_are_the_longer_a_schedule_for_people_waits(pool: Any, arcs: int, most: int) -> None:
    async def main() -> tuple[list[Schedule], Schedule]:
        async with pool() as here, here.beside(here.manager()):
            heard: list[Schedule] = []
            for number in range(arcs):
                arc = await here.arc(f"arc{number}")
                await arc.ask_for(request(arc.name, "left"))
            await here.clock.sleep_s(1.0)
            ear = here.network.join("ui_console/ear", here.clock)
            ear.subscribe(RC_MANAGER, Conversation.SCHEDULE, Schedule, lambda heard_of: heard.append(heard_of.body))
            for change in range(160):
                await ear.ask(RC_MANAGER, SetPriority("owner-arc0", change % 7 + 1), Done, within_s=1)
                await here.clock.sleep_s(0.02)
            await here.clock.sleep_s(0.5)
            newest = await ear.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=1)
            await ear.close()
            return heard, newest

    heard, newest = run_virtual(main())
    assert most / 2 <= len(heard) <= most + 5
    assert [one.priority for one in heard[-1].requests] == [one.priority for one in newest.requests]


def test_every_decision_is_in_the_trace(pool: Any) -> None:
    async def main() -> Path:
        async with pool() as here:
            async with here.beside(here.manager()):
                one = await here.arc("one")
                await one.ask_for(request("one", "left", "radio"))
                await here.clock.sleep_s(1.0)
            return here.trace  # type: ignore[no-any-return]

    lines = [json.loads(line) for line in run_virtual(main()).read_text().splitlines()]
    assert [line["ev"] for line in lines if line.get("arc") == "one"] == ["request", "connect", "grant"]
    assert lines[0]["ev"] == "meta"
    assert {line["id"] for line in lines if line["ev"] == "rc"} == {resource.name for resource in HARDWARE}
    assert lines[-1]["ev"] == "end"


@pytest.mark.parametrize("trace", ["/dev/full", "/dev/null/trace.jsonl"])
def test_a_trace_that_cannot_be_written_is_told_and_grants_go_on(local_mission: Any, beside: Any, trace: str) -> None:
    async def main() -> None:
        async with a_pool(local_mission, beside, Path(trace)) as here, here.beside(here.manager()) as manager:
            one = await here.arc("one")
            await one.ask_for(request("one", "left", "radio"))
            await here.clock.sleep_s(1.0)
            assert one.is_open
            assert "1 of 1 ARCs run; the trace of the schedule stopped: " in manager.feedback
            told = [event.what for event in manager.story.of("rc_manager")]
            assert sum("the trace of the schedule stopped" in what for what in told) == 1

    run_virtual(main())


def test_a_request_for_an_rc_that_the_placer_brings_back_waits_for_it(pool: Any) -> None:
    """Its host was lost, say: the placer has it in its book and starts it as soon as it can."""

    async def main() -> None:
        async with pool() as here, here.beside(here.manager()):
            placer = here.network.join(PLACER, here.clock)

            async def answer(asked: Envelope[Any]) -> Message:
                raise NameTaken(f"{asked.body.name} is waiting on no host yet")

            placer.serve(PLACER, Start, answer)
            here.rcs["left"].end("its host is lost")
            await here.clock.sleep_s(0.5)
            arc = await here.arc("arc")
            assert (await arc.ask_for(request("arc", "left", "radio"))).rcs
            await here.clock.sleep_s(5.0)
            assert not arc.is_open
            await here.rc(HARDWARE[0])
            await here.clock.sleep_s(1.0)
            assert arc.is_open
            await placer.close()

    run_virtual(main())
