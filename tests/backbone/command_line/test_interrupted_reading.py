"""Ctrl-C ends a command that reads a recording at once, and not only when all is read."""

from __future__ import annotations

import signal
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from mcap.writer import Writer
from small_recordings import SCOUT, Said, recorded

from backbone.command_line import comparing, event_loop, joining, recording_work, replaying
from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.recording import reader

MESSAGES, READ = 100, 10
ALL = replaying.Playing(None, 90.0, 1.0, False, ())

Command = Callable[[Path, Path], Awaitable[int]]


@pytest.fixture
def night(tmp_path: Path) -> Path:
    events = (StoryEvent(float(at), SCOUT, f"event {at}", "scout1", "", LogLevel.INFO) for at in range(MESSAGES))
    path = tmp_path / "night.mcap"
    path.write_bytes(recorded(Said(event.at_s, SCOUT, Conversation.LOG, event) for event in events).getvalue())
    return path


@pytest.fixture
def read(night: Path, monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """Return what a command has read or written of the night's messages; at one of them comes a Ctrl-C."""
    assert night.exists()
    messages: list[object] = []

    def interrupting(read_one: Callable[..., Any]) -> Callable[..., Any]:
        def read_next(*given: Any, **named: Any) -> Any:
            messages.append((given, named))
            if len(messages) == READ:
                signal.raise_signal(signal.SIGINT)
            return read_one(*given, **named)

        return read_next

    monkeypatch.setattr(reader, "Recorded", interrupting(reader.Recorded))
    monkeypatch.setattr(Writer, "add_message", interrupting(Writer.add_message))  # of what reads no message itself
    return messages


@pytest.mark.parametrize(
    "command",
    [
        lambda night, _new: recording_work.check_whole(night, as_json=True),
        lambda night, _new: recording_work.print_events(night, "", 0.0, None, as_json=True),
        lambda night, _new: comparing.compare(night, night, (), {}, as_json=True),
        recording_work.recover_to,
        lambda night, new: joining.join_to([night], new),
        lambda night, _new: replaying.play(night, ALL),
    ],
    ids=["check", "story", "compare", "recover", "join", "replay"],
)
def test_it_ends_at_once_and_leaves_nothing(
    command: Command, night: Path, read: list[object], tmp_path: Path, short_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(short_path))
    with pytest.raises(KeyboardInterrupt):
        event_loop.exit_code_of(lambda: command(night, tmp_path / "new.mcap"))
    assert len(read) == READ
    assert not (tmp_path / "new.mcap").exists()
    assert not list(short_path.rglob("replay-*"))
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_where_a_shell_ignores_ctrl_c_it_stays_ignored() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with event_loop.interruptible():
            signal.raise_signal(signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
