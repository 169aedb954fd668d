"""A pattern that no key can match is refused, because its listener would wait for ever."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.command_line import recording_work, watching
from backbone.command_line.key_patterns import ImpossiblePattern, check_patterns
from backbone.command_line.recording_work import OfLauncher, Splitting
from backbone.command_line.watching import Watched
from backbone.command_line.where import Where
from backbone.keys import COPIED, Conversation
from backbone.keys import key as key_of
from backbone.launcher import mission_connection
from backbone.launcher.endings import ExitCode
from backbone.naming import Subsystem
from backbone.recording.hearing import is_meant

ANY = Where(None, None, None)


@pytest.mark.parametrize(
    ("pattern", "why"),
    [
        ("", "it is empty"),
        (" ", "' ' is none of the last parts of keys"),
        ("a//b", "it has an empty part"),
        ("/backbone/placer/ask", "it has an empty part"),
        ("backbone/placer/status/", "it has an empty part"),
        ("scout1", "'scout1' is none of the last parts of keys"),
        ("backbone/placer/alive", "'alive' is none of the last parts of keys"),
        ("*/scout1/reading", "'reading' is none of the last parts of keys (did you mean 'readings'?)"),
        ("*/[c", "'[c' is none of the last parts of keys"),
        ("scout1/*", "'scout1' is no subsystem (did you mean 'scout'?)"),
        ("resource-pool/*", "'resource-pool' is no subsystem (did you mean 'resource_pool'?)"),
        ("scout/day/backbone/*", "the mission is night"),
    ],
)
def test_a_pattern_that_matches_no_key_is_refused_with_the_reason(pattern: str, why: str) -> None:
    with pytest.raises(ImpossiblePattern) as refused:
        check_patterns(("*", pattern), "night")
    assert refused.value.detail == f"{pattern!r} matches no key: {why}"


@pytest.mark.parametrize("subsystem", Subsystem)
@pytest.mark.parametrize("conversation", [one for one in Conversation if one not in {*COPIED, Conversation.ALIVE}])
def test_no_pattern_of_a_real_key_is_refused(subsystem: Subsystem, conversation: Conversation) -> None:
    key = key_of("night", f"{subsystem}/one", conversation)
    patterns = [
        "*",
        "*one*",
        "[a-z]*",
        "scout/*",
        f"*/{conversation}",
        f"{subsystem}/*",
        f"{subsystem}/one/[a-z]*",
        key,
    ]
    for pattern in [*patterns, key.split("/", 2)[-1], key.replace("night", "*"), key.replace("one", "on?")]:
        assert is_meant(key, (pattern,))
        check_patterns((pattern,), "night")


@pytest.mark.parametrize(
    "command",
    [
        lambda to: watching.watch(ANY, Watched(("",))),
        lambda to: watching.top(ANY, Watched(("",)), once=True),
        lambda to: recording_work.record_to(ANY, to, [""], None, Splitting(1.0, 1, 0), OfLauncher()),
    ],
    ids=["watch", "top", "record"],
)
def test_a_command_with_such_a_pattern_ends_at_once(
    command: Callable[[Path], Awaitable[ExitCode]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    @asynccontextmanager
    async def connected(*_where: object) -> AsyncIterator[tuple[Bus, VirtualClock]]:
        yield LocalBus(LocalNetwork("night"), "ui_console/cli-1", VirtualClock()), VirtualClock()

    monkeypatch.setattr(watching, "connected", connected)
    monkeypatch.setattr(mission_connection, "connected", connected)
    with pytest.raises(ImpossiblePattern):
        run_virtual(command(tmp_path / "new.mcap"))
    assert not list(tmp_path.iterdir())
