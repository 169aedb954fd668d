"""Commands that listen to a mission end with it, say so, and outlast a hub that was restarted."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager
from functools import partial

import pytest

from backbone.addresses import NAMESERVER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import LinkListener, Subscription
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.command_line import watching
from backbone.command_line.line_printer import LinePrinter
from backbone.command_line.listening import GONE_AFTER_S, until_ended
from backbone.command_line.watching import Watched
from backbone.command_line.where import Where
from backbone.component.messages import AskTime, LogLevel, MissionTime, StoryEvent
from backbone.component.mission_time import REPLY_TIME_S
from backbone.debug_views import LookAt, LookedAt, ViewEntry, ViewKind, Views
from backbone.keys import Conversation
from backbone.launcher.endings import ExitCode
from ui_console.terminal import look

SELF, BEHAVIOR = "ui_console/cli-1", "mission_control/watch"
ANY = Where(None, None, None)
UP, DOWN = True, False
FOR_HOURS_S = 10_000.0


class LinkedBus(LocalBus):
    """A bus whose link to a hub changes when the test says so: pairs of time and state."""

    def __init__(self, link: Sequence[tuple[float, bool]]) -> None:
        super().__init__(LocalNetwork("night"), SELF, VirtualClock())
        self._link = link

    def watch_link(self, listener: LinkListener) -> Subscription:
        for at_s, is_up in self._link:
            asyncio.get_running_loop().call_at(at_s, listener, is_up)
        return self.watch_alive("nobody/*", lambda _address, _alive: None)


async def lasted_s(bus: LocalBus, for_s: float | None = None) -> float:
    async with until_ended(bus, VirtualClock(), for_s) as ended:
        await ended.wait()
    return VirtualClock().now_s()


@pytest.mark.parametrize(
    ("link", "ends_s"),
    [
        ([(0.0, UP), (20.0, DOWN)], 20.0 + GONE_AFTER_S),
        ([(0.0, UP), (20.0, DOWN), (20.0 + 0.9 * GONE_AFTER_S, UP), (60.0, DOWN)], 60.0 + GONE_AFTER_S),
        ([(0.0, UP), (20.0, DOWN), (22.0, DOWN)], 22.0 + GONE_AFTER_S),
        ([], GONE_AFTER_S),
    ],
    ids=["it ends", "its hub was restarted", "told twice", "it had ended before"],
)
def test_a_command_ends_and_says_so_once_the_hub_was_away_for_seconds(
    link: list[tuple[float, bool]], ends_s: float, capsys: pytest.CaptureFixture[str]
) -> None:
    async def play() -> float:
        return await lasted_s(LinkedBus(link))

    assert run_virtual(play()) == pytest.approx(ends_s)
    assert capsys.readouterr().err == "night has ended, or its hub cannot be reached\n"


@pytest.mark.parametrize("again", [[], [(102.5, DOWN), (102.7, UP)]], ids=["away once", "away twice"])
def test_a_command_ends_and_says_so_once_its_mission_was_started_again(
    again: list[tuple[float, bool]], capsys: pytest.CaptureFixture[str]
) -> None:
    link = [(0.0, UP), (100.0, DOWN), (102.0, UP), *again]

    async def play() -> float:
        bus = LinkedBus(link)
        asyncio.get_running_loop().call_at(103.0, serve_time, bus, 102.0)
        async with asyncio.timeout(FOR_HOURS_S):
            return await lasted_s(bus)

    assert run_virtual(play()) == pytest.approx(103.0, abs=2 * REPLY_TIME_S)
    assert "night was started again" in capsys.readouterr().err


@pytest.mark.parametrize("behind_s", [0.0, 0.5, -3600.0], ids=["same", "by the way of an answer", "the clock slept"])
def test_a_command_goes_on_if_only_the_hub_was_started_again(
    behind_s: float, capsys: pytest.CaptureFixture[str]
) -> None:
    async def play() -> float:
        bus = LinkedBus([(0.0, UP), (100.0, DOWN), (102.0, UP)])
        asyncio.get_running_loop().call_at(103.0, serve_time, bus, behind_s)
        return await lasted_s(bus, 200.0)

    assert run_virtual(play()) == pytest.approx(200.0)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(("start_s", "ends"), [(77.0, False), (99.0, True)], ids=["the same start", "a later one"])
def test_a_command_goes_on_after_a_sleep_of_the_first_host(
    start_s: float, ends: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    async def play() -> float:
        bus = LinkedBus([(0.0, UP), (100.0, DOWN), (102.0, UP)])
        serve_time(bus, 0.0, 77.0)
        asyncio.get_running_loop().call_at(101.0, serve_time, bus, 50.0, start_s)
        return await lasted_s(bus, 200.0)

    assert run_virtual(play()) == pytest.approx(102.0 if ends else 200.0)
    assert ("night was started again" in capsys.readouterr().err) == ends


def serve_time(bus: LocalBus, origin_s: float, start_s: float = 0.0) -> None:
    """Answer as the nameserver of a mission that began at this time; its first host's clock showed ``start_s`` then."""

    async def answer(_asked: object) -> MissionTime:
        return MissionTime(VirtualClock().now_s() - origin_s, 1.0, 0.0, start_s)

    LocalBus(bus.network, NAMESERVER, VirtualClock()).serve(NAMESERVER, AskTime, answer)


def test_a_command_ends_after_its_time_and_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    async def play() -> float:
        return await lasted_s(LinkedBus([(0.0, UP)]), 100.0)

    assert run_virtual(play()) == pytest.approx(100.0)
    assert capsys.readouterr().err == ""


def test_a_bug_of_a_listener_ends_the_command() -> None:
    async def play() -> None:
        bus = LinkedBus([(0.0, UP)])
        asyncio.get_running_loop().call_later(3.0, lambda: bus.on_bug(ValueError("bug")))
        await lasted_s(bus)

    with pytest.raises(ValueError, match="bug"):
        run_virtual(play())


@pytest.mark.parametrize(
    "command",
    [
        lambda: watching.watch(ANY, Watched(())),
        lambda: watching.top(ANY, Watched(()), once=False),
        lambda: watching.top(ANY, Watched((), for_s=FOR_HOURS_S), once=True),
    ],
    ids=["watch", "watch --rate", "top --for"],
)
def test_who_watches_a_mission_ends_with_it(
    command: Callable[[], Awaitable[ExitCode]], monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    @asynccontextmanager
    async def connected(_where: Where) -> AsyncIterator[tuple[LocalBus, VirtualClock]]:
        yield LinkedBus([(0.0, UP), (20.0, DOWN)]), VirtualClock()

    async def play() -> float:
        async with asyncio.timeout(FOR_HOURS_S / 2):
            assert await command() is ExitCode.DONE
        return VirtualClock().now_s()

    monkeypatch.setattr(watching, "connected", connected)
    assert run_virtual(play()) == pytest.approx(20.0 + GONE_AFTER_S, abs=1.0)
    assert "night has ended" in capfd.readouterr().err


class StuckPrinter(LinePrinter):
    """Prints to a reader that does not read."""

    def put(self, _line: str) -> None:
        self.dropped += 1

    async def end(self) -> None:
        await super().end()
        self.is_stuck = True


@pytest.mark.parametrize(
    "command",
    [lambda: watching.watch(ANY, Watched((), for_s=2.0)), lambda: watching.top(ANY, Watched((), for_s=2.0), once=True)],
    ids=["watch", "top"],
)
def test_output_that_no_reader_takes_is_no_success(
    command: Callable[[], Awaitable[ExitCode]], monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    @asynccontextmanager
    async def connected(_where: Where) -> AsyncIterator[tuple[LocalBus, VirtualClock]]:
        yield LinkedBus([(0.0, UP)]), VirtualClock()

    monkeypatch.setattr(watching, "connected", connected)
    monkeypatch.setattr(watching, "LinePrinter", StuckPrinter)
    assert run_virtual(command()) is ExitCode.UNEXPECTED
    assert capfd.readouterr().out == ""


@pytest.mark.parametrize(
    "command",
    [
        lambda: watching.watch(ANY, Watched((), for_s=30.0)),
        lambda: watching.top(ANY, Watched((), for_s=30.0), once=False),
    ],
    ids=["watch", "top"],
)
def test_who_watches_is_told_of_an_absence_of_the_hub(
    command: Callable[[], Awaitable[ExitCode]], monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    @asynccontextmanager
    async def connected(_where: Where) -> AsyncIterator[tuple[LocalBus, VirtualClock]]:
        yield LinkedBus([(0.0, UP), (20.0, DOWN), (21.5, UP)]), VirtualClock()

    monkeypatch.setattr(watching, "connected", connected)
    run_virtual(command())
    told = "incomplete: the hub was away for 1.5 s; an unknown number of messages is missing"
    assert told in capfd.readouterr().err.splitlines()


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ((), "no message came"),
        (("*/a/log", "*[bc]"), "no message came at */a/log or *[bc]; 'scout-backbone top' shows all keys"),
    ],
)
@pytest.mark.parametrize("command", [watching.watch, partial(watching.top, once=True)], ids=["watch", "top"])
def test_an_end_without_a_message_is_told(
    command: Callable[[Where, Watched], Awaitable[ExitCode]],
    keys: tuple[str, ...],
    told: str,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    network, clock = LocalNetwork("night"), VirtualClock()

    @asynccontextmanager
    async def connected(_where: Where) -> AsyncIterator[tuple[LocalBus, VirtualClock]]:
        yield LocalBus(network, SELF, clock), clock

    monkeypatch.setattr(watching, "connected", connected)
    run_virtual(command(ANY, Watched(keys, for_s=1.0)))
    shown = capfd.readouterr()
    assert told in shown.err.splitlines()
    assert shown.out == ""


@pytest.mark.parametrize(("field", "is_told"), [("what", False), ("waht", True)])
def test_a_field_that_no_message_has_is_told(
    field: str, is_told: bool, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    network, clock = LocalNetwork("night"), VirtualClock()

    @asynccontextmanager
    async def connected(_where: Where) -> AsyncIterator[tuple[LocalBus, VirtualClock]]:
        yield LocalBus(network, SELF, clock), clock

    async def play() -> None:
        watches = asyncio.create_task(watching.watch(ANY, Watched((), field, for_s=10.0)))
        await clock.sleep_s(5.0)
        told = StoryEvent(1.0, BEHAVIOR, "motion seen", "scout1", "", LogLevel.INFO)
        LocalBus(network, BEHAVIOR, clock).publish(BEHAVIOR, Conversation.LOG, told)
        await watches

    monkeypatch.setattr(watching, "connected", connected)
    run_virtual(play())
    shown = capfd.readouterr()
    assert ("none of 1 message has a value in 'waht'" in shown.err) is is_told
    assert ("motion seen" in shown.out) is not is_told


def test_who_looks_into_a_behavior_ends_with_its_mission(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    @asynccontextmanager
    async def connected(_where: Where) -> AsyncIterator[tuple[LocalBus, VirtualClock]]:
        bus = LinkedBus([(0.0, UP), (20.0, DOWN)])
        LocalBus(bus.network, BEHAVIOR, VirtualClock()).serve(BEHAVIOR, LookAt, answer)
        yield bus, VirtualClock()

    async def answer(_asked: object) -> LookedAt:
        return LookedAt("threshold", ViewKind.VALUE, FOR_HOURS_S)

    async def found(_bus: object, _name: str) -> str:
        return BEHAVIOR

    async def views(_bus: object, _behavior: str) -> Views:
        return Views([ViewEntry("threshold", ViewKind.VALUE, 28.0)])

    async def play() -> float:
        async with asyncio.timeout(FOR_HOURS_S):
            assert await look.look_into(ANY, "watch", "threshold", look.LookOptions()) is ExitCode.DONE
        return VirtualClock().now_s()

    monkeypatch.setattr(look, "connected", connected)
    monkeypatch.setattr(look, "find_behavior", found)
    monkeypatch.setattr(look, "views_of", views)
    assert run_virtual(play()) == pytest.approx(20.0 + GONE_AFTER_S)
    assert capsys.readouterr().err.endswith("night has ended, or its hub cannot be reached\n")
