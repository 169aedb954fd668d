"""A recording is played by the command, fast or message by message, and all comes in its order."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from running_mission import BIN
from small_recordings import MISSION, SCOUT, Said, recorded

from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

NAME = f"replay-{MISSION}"
ANNOUNCER = "backbone/replay"
EVENTS = [f"event {number}" for number in range(200)]


@pytest.fixture
def recording(short_path: Path) -> Path:
    """Return a recording with an event of one robot after the other, many of them at one time."""
    said = [
        Said(number // 4 / 10, where, Conversation.LOG, StoryEvent(0.0, where, what, "x", "", LogLevel.INFO), where)
        for number, what in enumerate(EVENTS)
        for where in [(SCOUT, "resource_pool/scout2")[number % 2]]
    ]
    path = short_path / "it.mcap"
    path.write_bytes(recorded(said).getvalue())
    return path


@contextmanager
def replay(path: Path, *options: str) -> Iterator[subprocess.Popen[str]]:
    """Play the recording; it is up when this is entered."""
    words = [str(BIN / "scout-backbone"), "replay", str(path), *options]
    player = subprocess.Popen(
        words, env=environment(path), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert player.stderr is not None
    try:
        said = player.stderr.readline()
        assert said.startswith("plays "), said
        yield player
    finally:
        player.kill()
        player.communicate(timeout=20)


def environment(path: Path) -> dict[str, str]:
    return {**os.environ, "XDG_RUNTIME_DIR": str(path.parent)}


@pytest.mark.thorough
def test_at_ten_times_the_speed_a_listener_that_waited_hears_all_in_order(recording: Path) -> None:
    """A listener that hears the announcement waited; a busy machine may need a second, longer wait for that."""
    for wait_s in (4, 40):
        with replay(recording, "--speed", "10", f"--from=-{10 * wait_s}"):
            words = ["watch", f"{SCOUT}/log", f"{ANNOUNCER}/log", "--json", "--most", "101", "--for", str(wait_s + 20)]
            heard = subprocess.run(
                [str(BIN / "scout-backbone"), *words, "--mission", NAME],
                env=environment(recording),
                stdout=subprocess.PIPE,
                check=True,
            )
        said = [json.loads(line) for line in heard.stdout.splitlines()]
        if said and said[0]["source"] == ANNOUNCER:
            break
    assert [one["body"]["what"] for one in said[1:]] == EVENTS[::2]


def test_in_steps_each_line_of_input_plays_the_next_message(recording: Path) -> None:
    with replay(recording, "--step") as player:
        assert player.stdin is not None
        assert player.stdout is not None
        for what in EVENTS[:20]:
            assert f'"{what}"' in player.stdout.readline()
            player.stdin.write("\n")
            player.stdin.flush()


@pytest.mark.parametrize("order", [signal.SIGINT, signal.SIGTERM])
def test_a_step_that_is_awaited_holds_up_no_end(recording: Path, order: signal.Signals) -> None:
    with replay(recording, "--step") as player:
        assert player.stdout is not None
        assert player.stderr is not None
        player.stdout.readline()
        player.send_signal(order)
        assert player.wait(20) == 0
        assert player.stderr.read() == ""
