"""The keeper on virtual time: components run in this process, the nameserver too."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import msgspec
import pytest
from in_process_zygote import InProcessZygote

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus
from backbone.component.heartbeat import Vitals
from backbone.component.launch import Launch
from backbone.component.logs import log_path
from backbone.component.messages import OtherIncarnation, Stop, Stopping
from backbone.creator.failed_starts import LAST_LINES, last_lines
from backbone.creator.messages import AlreadyHere, EndedBy, NotHere, ProcessFell, RestartPolicy, StartFailed
from backbone.creator.process_keeper import ProcessKeeper
from backbone.creator.silence import LOOK_EVERY_S
from backbone.keys import Conversation
from backbone.naming import Subsystem

FIRST_PID = 1001  # of an InProcessZygote
POLICY = RestartPolicy(back_off_s=0.1, limit=2, window_s=60.0)


@dataclass
class Bench:
    keeper: ProcessKeeper
    zygote: InProcessZygote
    fell: list[ProcessFell]
    bus: Bus
    vitals: dict[int, Vitals]

    async def start(self, kind: str, name: str, policy: RestartPolicy = POLICY, within_s: float = 5.0) -> int:
        return await self.keeper.start(launch(kind, name), policy, within_s)


def launch(kind: str, name: str) -> Launch:
    path = f"in_process_zygote:{kind}"
    return Launch(
        "local",
        Subsystem.RESOURCE_POOL,
        name,
        kind.lower(),
        path,
        "local",
        "",
        0.0,
        1.0,
        run_directory="looked at through the bench's vitals",
    )


@pytest.fixture
def on_bench(local_mission: Callable) -> Callable[[Callable[[Bench], Awaitable[None]]], None]:
    """Return a runner of a test's body with a keeper that is closed afterwards."""

    @asynccontextmanager
    async def bench() -> AsyncIterator[Bench]:
        async with local_mission() as network:
            zygote, fell, vitals = InProcessZygote(network), [], dict[int, Vitals]()

            def look(_folder: str, pid: int) -> Vitals:
                """Every process beats at each look, unless the test sets the beats."""
                return vitals.get(pid) or Vitals(int(now_s() * 1000))

            keeper = ProcessKeeper(zygote, VirtualClock(), look)
            keeper.on_fell = fell.append
            bus = network.join("backbone/tester", VirtualClock())
            keeper.use(bus)
            yield Bench(keeper, zygote, fell, bus, vitals)
            await keeper.close()
            assert not zygote.lives, "something was left after the keeper's end"
            await bus.close()

    def run(body: Callable[[Bench], Awaitable[None]]) -> None:
        async def main() -> None:
            async with bench() as it:
                await body(it)

        run_virtual(main())

    return run


def now_s() -> float:
    return asyncio.get_running_loop().time()


def test_start_returns_the_pid_when_the_component_is_ready(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        pid = await bench.start("Quiet", "scout1")
        assert list(bench.zygote.lives) == [pid]
        assert [(each.spawn.name, each.pid) for each in bench.keeper.processes()] == [("scout1", pid)]

    on_bench(body)


def test_a_zygote_that_is_absent_has_its_owner_in_its_name(on_bench: Callable) -> None:
    """Each host has one, so health would show only one of two with the same name."""

    async def body(bench: Bench) -> None:
        await bench.start("Quiet", "scout1")
        bench.zygote.trouble = "it was stopped"
        await VirtualClock().sleep_s(2.0)
        [absent] = bench.keeper.absences()
        assert (absent.name, absent.cause) == ("zygote of tester", "it was stopped")

    on_bench(body)


def test_a_killed_component_is_restarted_after_its_back_off_and_slowly_from_the_limit_on(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        await bench.start("Quiet", "scout1")
        for _ in range(2):
            bench.zygote.kill(bench.keeper.processes()[0].pid, signal.SIGKILL)
            await VirtualClock().sleep_s(1.0)
            assert bench.keeper.processes()[0].pid in bench.zygote.lives
        bench.zygote.kill(bench.keeper.processes()[0].pid, signal.SIGKILL)
        await VirtualClock().sleep_s(1.0)
        state = bench.keeper.processes()[0]
        assert (state.restarts, state.pid, state.last_end) == (2, 0, "killed by SIGKILL")
        assert [fell.restart_in_s for fell in bench.fell] == [0.1, 0.2, POLICY.failing_pause_s]
        await VirtualClock().sleep_s(POLICY.failing_pause_s)
        assert bench.keeper.processes()[0].pid in bench.zygote.lives

    on_bench(body)


def test_a_component_without_restart_that_ends_by_itself_is_forgotten(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        await bench.start("Leaver", "watcher", RestartPolicy(restart=False))
        await VirtualClock().sleep_s(2.0)
        assert bench.keeper.processes() == []
        assert bench.fell == []
        with pytest.raises(NotHere):
            await bench.keeper.end("watcher")

    on_bench(body)


def test_a_start_that_is_not_ready_in_time_fails_and_leaves_nothing(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        bench.vitals[FIRST_PID] = Vitals(1)
        with pytest.raises(StartFailed, match="not ready"):
            await bench.start("Late", "slow")
        assert not bench.zygote.lives
        assert now_s() < 6.0

    on_bench(body)


def test_a_slow_start_that_shows_signs_of_life_is_waited_for(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        assert await bench.start("Late", "slow", within_s=5.0) == FIRST_PID
        assert now_s() >= 10.0 - 1e-9  # sums of looks

    on_bench(body)


def test_a_ready_process_without_a_sign_of_life_is_reported_then_replaced(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        pid = await bench.start("Quiet", "scout1")
        await VirtualClock().sleep_s(1.0)
        bench.vitals[pid] = Vitals(5)
        await VirtualClock().sleep_s(1.0)
        assert [absence.name for absence in bench.keeper.absences()] == ["scout1"]
        assert bench.keeper.processes()[0].silent_s > 0
        assert bench.zygote.wrote_stacks == []
        await VirtualClock().sleep_s(POLICY.hung_after_s)
        assert bench.zygote.wrote_stacks == [pid]
        assert pid not in bench.zygote.lives
        assert bench.keeper.processes()[0].pid in bench.zygote.lives
        assert bench.keeper.absences() == []
        assert bench.fell[0].how.startswith("hung")

    on_bench(body)


def test_a_ready_process_that_could_not_make_its_file_is_not_judged(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        pid = await bench.start("Quiet", "scout1")
        bench.vitals[pid] = Vitals(0)
        await VirtualClock().sleep_s(10.0)
        assert bench.keeper.absences() == []
        assert pid in bench.zygote.lives

    on_bench(body)


def test_a_starved_process_is_not_taken_for_hung(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        pid = await bench.start("Quiet", "scout1")
        for _ in range(40):
            bench.vitals[pid] = Vitals(5, queued_s=now_s())
            await VirtualClock().sleep_s(LOOK_EVERY_S)
        assert bench.keeper.absences() == []
        assert pid in bench.zygote.lives

    on_bench(body)


def test_a_start_that_breaks_fails_at_once(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        with pytest.raises(StartFailed, match="exit code 1"):
            await bench.start("Broken", "broken")
        assert now_s() < 0.1
        assert bench.keeper.processes() == []

    on_bench(body)


def test_a_start_without_a_process_fails_with_the_reason(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        bench.zygote.refuses = "too many processes"
        with pytest.raises(StartFailed, match="too many processes"):
            await bench.start("Quiet", "scout1")
        with pytest.raises(StartFailed, match="too many processes"):
            await bench.keeper.start_hub(launch("Quiet", "hub"), POLICY)

    on_bench(body)


def test_nothing_is_signalled_because_its_end_is_reported_late_by_a_busy_zygote(on_bench: Callable) -> None:
    """On a full machine processes had ended, and their ends were reported seconds later."""

    async def body(bench: Bench) -> None:
        await bench.start("Stubborn", "scout1")
        ending, began_s = asyncio.create_task(bench.keeper.end("scout1", "over", 1.5, 0.5)), now_s()
        for _ in range(20):
            await VirtualClock().sleep_s(LOOK_EVERY_S)
            bench.zygote.was_busy_s += LOOK_EVERY_S
        assert (await ending).by is EndedBy.SIGKILL
        assert now_s() == pytest.approx(began_s + 20 * LOOK_EVERY_S + 2.0, abs=2 * LOOK_EVERY_S)

    on_bench(body)


def test_end_says_what_it_took(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        await bench.start("Quiet", "obeys")
        await bench.start("Stubborn", "hangs")
        assert (await bench.keeper.end("obeys", "over")).by is EndedBy.ASKING
        began_s = now_s()
        assert (await bench.keeper.end("hangs", "over", 1.5, 0.5)).by is EndedBy.SIGKILL
        assert now_s() - began_s == pytest.approx(2.0, abs=0.01)

    on_bench(body)


def test_everybody_who_ordered_an_end_is_answered(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        await bench.start("Stubborn", "hangs")
        ends = await asyncio.gather(bench.keeper.end("hangs", "one"), bench.keeper.end("hangs", "two", 0.1, 0.1))
        assert ends[0] == ends[1]
        assert now_s() < 0.5

    on_bench(body)


def test_a_start_hears_that_its_component_was_ended_meanwhile(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        starting = asyncio.create_task(bench.start("Late", "slow"))
        await VirtualClock().sleep_s(1.0)
        await bench.keeper.end("slow")
        with pytest.raises(StartFailed):
            await starting

    on_bench(body)


def test_a_name_runs_once(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        await bench.start("Quiet", "scout1")
        with pytest.raises(AlreadyHere):
            await bench.start("Quiet", "scout1")

    on_bench(body)


def test_waiting_for_readiness_outlasts_a_restart(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        pid = await bench.start("Quiet", "scout1")
        assert await bench.keeper.wait_ready("scout1", 1.0) == pid
        bench.zygote.kill(pid, signal.SIGKILL)
        await VirtualClock().sleep_s(0.01)
        assert await bench.keeper.wait_ready("scout1", 1.0) > pid

    on_bench(body)


def test_waiting_for_readiness_ends_when_there_is_no_restart(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        pid = await bench.start("Quiet", "scout1", RestartPolicy(restart=False))
        bench.zygote.kill(pid, signal.SIGKILL)
        await VirtualClock().sleep_s(0.01)
        with pytest.raises(NotHere):
            await bench.keeper.wait_ready("scout1", 1.0)

    on_bench(body)


def test_an_order_to_stop_is_meant_for_one_life_only(on_bench: Callable) -> None:
    """A copy of the same name on another host must not obey the order for this one."""

    async def body(bench: Bench) -> None:
        await bench.start("Quiet", "scout1")
        with pytest.raises(OtherIncarnation):
            await bench.bus.ask("resource_pool/scout1", Stop("meant for another", "far.7.1"), Stopping, within_s=1.0)
        assert bench.zygote.lives
        assert (await bench.keeper.end("scout1")).by is EndedBy.ASKING

    on_bench(body)


def test_closing_ends_the_last_started_first_and_waits_for_nobody_who_hangs(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        for kind, name in [("Quiet", "first"), ("Stubborn", "second"), ("Stubborn", "third"), ("Quiet", "fourth")]:
            await bench.start(kind, name)
        ended = await bench.keeper.close()
        assert [(end.name, end.by) for end in ended] == [
            ("fourth", EndedBy.ASKING),
            ("third", EndedBy.SIGKILL),
            ("second", EndedBy.SIGKILL),
            ("first", EndedBy.ASKING),
        ]
        assert now_s() < 2.5
        with pytest.raises(StartFailed, match="being ended"):
            await bench.start("Quiet", "late")

    on_bench(body)


def test_closing_ends_who_waits_for_a_restart(on_bench: Callable) -> None:
    async def body(bench: Bench) -> None:
        pid = await bench.start("Quiet", "scout1")
        bench.zygote.kill(pid, signal.SIGKILL)
        await VirtualClock().sleep_s(0.01)
        assert [end.by for end in await bench.keeper.close()] == [EndedBy.ITSELF]
        await VirtualClock().sleep_s(5.0)
        assert bench.zygote.forked == ["scout1"]

    on_bench(body)


def test_the_end_of_a_log_is_shown_without_reading_all_of_it(tmp_path: Path) -> None:
    assert last_lines(str(tmp_path), "nobody") == []
    path = log_path(str(tmp_path), "scout1")
    path.parent.mkdir()
    path.write_text("\n".join(f"line {number}" for number in range(100_000)))
    assert last_lines(str(tmp_path), "scout1") == [f"line {number}" for number in range(100_000 - LAST_LINES, 100_000)]


def test_who_falls_says_the_bug_that_its_log_ends_with(on_bench: Callable, tmp_path: Path) -> None:
    async def body(bench: Bench) -> None:
        started = msgspec.structs.replace(launch("Failing", "failing"), run_directory=str(tmp_path))
        path = log_path(str(tmp_path), "failing")
        path.parent.mkdir()
        told = "12:00 ERROR x: process {}: resource_pool/failing ended by a bug: {}"
        bug, older = told.format(FIRST_PID, "ValueError: no picture (pair.py, line 7)"), told.format(7, "KeyError: 'a'")
        path.write_text("\n".join([bug, older, "Traceback (most recent call last):", *["  a frame"] * LAST_LINES, ""]))
        await bench.keeper.start(started, POLICY, 5.0)
        bench.bus.publish("resource_pool/failing", Conversation.COMMAND, Stop("now"))
        await VirtualClock().sleep_s(0.05)
        [state] = bench.keeper.processes()
        assert state.last_end == "exit code 1: ValueError: no picture (pair.py, line 7)"
        [fell] = bench.fell
        assert fell.how == state.last_end

    on_bench(body)


def test_who_falls_is_restarted_though_its_log_cannot_be_read(on_bench: Callable, tmp_path: Path) -> None:
    async def body(bench: Bench) -> None:
        started = msgspec.structs.replace(launch("Failing", "failing"), run_directory=str(tmp_path))
        log_path(str(tmp_path), "failing").mkdir(parents=True)
        await bench.keeper.start(started, POLICY, 5.0)
        bench.bus.publish("resource_pool/failing", Conversation.COMMAND, Stop("now"))
        await VirtualClock().sleep_s(1.0)
        [state] = bench.keeper.processes()
        assert (state.pid, state.restarts, state.last_end) == (FIRST_PID + 1, 1, "exit code 1")

    on_bench(body)
