"""Ctrl-C ends a command that reads a recording at once, and not only when all is read."""

from __future__ import annotations

import asyncio
import io
import signal
import subprocess
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from full_disk import disk_full_at
from mcap.writer import Writer
from small_recordings import SCOUT, Said, recorded

from backbone.command_line import comparing, event_loop, exporting, foxglove_copy, joining, recording_work, replaying
from backbone.command_line.unusable_file import FileUnusable, new_folder
from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.launcher.endings import ExitCode, show
from backbone.operating_system.ending_signals import interruptible
from backbone.recording import reader

MESSAGES, READ = 100, 10
HANGS = """
import os, signal, sys, threading
from pathlib import Path
from backbone.command_line import event_loop, replaying
def hang(*_given):
    os.kill(os.getpid(), signal.SIGINT)
    threading.Event().wait()
replaying.run_again = hang
event_loop.exit_code_of(lambda: replaying.run_without(Path(sys.argv[1]), [], "", {}, {}, as_json=True))
"""
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
        lambda night, new: exporting.export(night, new, (), exporting.CsvTables, with_videos=False),
        lambda night, new: foxglove_copy.copy_for_foxglove(night, new, ()),
    ],
    ids=["check", "story", "compare", "recover", "join", "replay", "export", "foxglove"],
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


class _Interrupting(io.StringIO):
    """An output at which a Ctrl-C comes while a line is written."""

    def write(self, text: str) -> int:
        signal.raise_signal(signal.SIGINT)
        return super().write(text)


def test_it_ends_while_its_output_is_not_read(monkeypatch: pytest.MonkeyPatch) -> None:
    output = _Interrupting()
    monkeypatch.setattr("sys.stdout", output)

    async def command() -> ExitCode:
        show(["a line", "another"])
        return ExitCode.DONE

    with pytest.raises(KeyboardInterrupt):
        event_loop.exit_code_of(command)
    assert output.getvalue() == ""


def test_a_step_of_a_replay_passes_its_ctrl_c_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdout", _Interrupting())
    monkeypatch.setattr(replaying, "message_line", lambda _message: "a line")
    monkeypatch.setattr(replaying, "_read_line", lambda: False)

    async def main() -> None:
        ended, loop = asyncio.Event(), asyncio.get_running_loop()
        loop.add_signal_handler(signal.SIGINT, ended.set)
        asked: Any = replaying._asked_for_step  # noqa: SLF001  the player calls it before each message
        step = asyncio.create_task(asked(None))
        await asyncio.wait_for(ended.wait(), 10)
        step.cancel()

    asyncio.run(main())


@pytest.mark.processes
@pytest.mark.timeout(60)
def test_a_component_that_hangs_in_a_rerun_holds_up_no_ctrl_c(night: Path) -> None:
    done = subprocess.run([sys.executable, "-c", HANGS, str(night)], timeout=30, check=False, capture_output=True)
    assert done.returncode == -signal.SIGINT, done.stderr


@pytest.mark.parametrize("order", [signal.SIGTERM, signal.SIGHUP])
def test_an_order_to_end_leaves_nothing_half_written(order: signal.Signals, tmp_path: Path) -> None:
    def write() -> None:
        with interruptible(), new_folder(tmp_path / "new"):
            assert signal.getsignal(order) is not signal.SIG_DFL  # else the order would end this test run
            signal.raise_signal(order)

    before = signal.signal(order, signal.SIG_DFL)  # as nohup starts a test run, SIGHUP is ignored
    try:
        with pytest.raises(KeyboardInterrupt):
            write()
        assert [*tmp_path.iterdir()] == []
        assert signal.getsignal(order) is signal.SIG_DFL
    finally:
        signal.signal(order, before)


def test_half_an_output_is_never_taken_for_a_whole_one(tmp_path: Path) -> None:
    """An export that was killed left a folder like a complete one, with tables that were cut."""
    night = tmp_path / "night"
    with new_folder(night) as made:
        (made / "table.csv").write_text("at_s")
        assert not night.exists()
        assert made.name.endswith(".partial")
    assert [one.name for one in tmp_path.rglob("*")] == ["night", "table.csv"]
    with pytest.raises(FileUnusable, match="night exists"), new_folder(night):
        pass


def test_where_a_shell_ignores_ctrl_c_it_stays_ignored() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with interruptible():
            signal.raise_signal(signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


NEW: list[Command] = [
    lambda night, new: joining.join_to([night], new),
    lambda night, new: exporting.export(night, new, (), exporting.CsvTables, with_videos=False),
    lambda night, new: foxglove_copy.copy_for_foxglove(night, new, ()),
]
names_of_new = pytest.mark.parametrize("command", NEW, ids=["join", "export", "foxglove"])


@pytest.mark.parametrize("command", [*NEW, recording_work.recover_to], ids=["join", "export", "foxglove", "recover"])
def test_what_finds_no_room_leaves_nothing_and_can_be_repeated(
    command: Command, night: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    new = tmp_path / "new.mcap"
    with disk_full_at(1000):
        assert event_loop.exit_code_of(lambda: command(night, new)) == ExitCode.USAGE
    assert "(Write it to a disk that has room.)" in capsys.readouterr().err
    assert not new.exists()
    assert event_loop.exit_code_of(lambda: command(night, new)) == ExitCode.DONE


@names_of_new
def test_of_a_damaged_recording_no_copy_is_left_that_looks_whole(command: Command, night: Path, tmp_path: Path) -> None:
    data = bytearray(night.read_bytes())
    data[len(data) // 4] ^= 0xFF
    night.write_bytes(data)
    new = tmp_path / "new.mcap"
    assert event_loop.exit_code_of(lambda: command(night, new)) == ExitCode.REFUSED
    assert not new.exists()
