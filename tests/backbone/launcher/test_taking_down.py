"""``down`` of a mission that ends meanwhile by itself, or by another ``down``, or is of another release."""

from __future__ import annotations

import asyncio
import subprocess
from pathlib import Path
from typing import Any

import pytest

from backbone import run_files
from backbone.creator.messages import EndedBy, ProcessEnded
from backbone.errors import HubUnreachable, LinkError, NoResponder, ReplyTimeout
from backbone.launcher import detached
from backbone.launcher.ending_messages import EndMission, MissionEnded, MissionEnding
from backbone.run_files import RunFile
from backbone.wire import Message, WrongVersion

pytestmark = pytest.mark.processes


@pytest.mark.parametrize("when", ["before it is asked", "while it is asked"])
def test_a_launcher_that_ends_meanwhile_is_down(
    when: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    launcher = subprocess.Popen(["sleep", "60"])
    found = RunFile("m", "unixsock-stream/nowhere", launcher.pid, 0.0, 1.0, "base", "m.xml")

    class Unreachable:
        @staticmethod
        async def open_when_up(*_given: Any) -> Any:
            end()
            raise HubUnreachable("nowhere")

    def end() -> None:
        launcher.kill()
        launcher.wait()

    def find(_mission: str | None) -> RunFile:
        if when == "before it is asked":
            end()
        return found

    monkeypatch.setattr(detached, "ZenohBus", Unreachable)
    monkeypatch.setattr(run_files, "find", find)
    assert asyncio.run(detached.take_down("m")) == 0
    assert "mission m is down; its launcher has ended meanwhile" in capsys.readouterr().err


def test_a_launcher_of_another_release_is_ended_by_a_signal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Speechless:
        source = "ui_console/down-1"

        @classmethod
        async def open_when_up(cls, *_given: Any) -> Speechless:
            return cls()

        def publish(self, *_given: Any) -> None: ...

        async def ask(self, *_given: Any, **_by_name: Any) -> Any:
            raise WrongVersion("envelope version 1, but version 2 is expected")

        async def close(self) -> None: ...

    with subprocess.Popen(["sleep", "60"]) as launcher:
        found = RunFile("m", "unixsock-stream/nowhere", launcher.pid, 0.0, 1.0, "base", "m.xml")
        monkeypatch.setattr(detached, "ZenohBus", Speechless)
        monkeypatch.setattr(run_files, "find", lambda _mission: found)
        assert asyncio.run(detached.take_down("m")) == 0
    told = capsys.readouterr().err
    assert "does not take the order" in told
    assert "bring the mission up anew" in told
    assert "mission m is down; SIGTERM was enough" in told


KILLED = ProcessEnded("spin", EndedBy.SIGKILL, 0)
ACCOUNTS = [
    (MissionEnded([]), "mission m is down; asking was enough"),
    (MissionEnded([KILLED]), "mission m is down; needed a signal to end: spin (sigkill)"),
    (NoResponder("it fell"), "mission m is down; it is unknown whether its components needed a signal"),
    (MissionEnding(has_components=False), "mission m is down; asking was enough"),
    (
        ReplyTimeout("no answer within 20 s"),
        "not all components have ended within 20 s\nmission m is down; SIGTERM was enough",
    ),
]


@pytest.mark.parametrize("answer_s", [0.0, 5.0], ids=["", "full machine"])
@pytest.mark.parametrize(("account", "words"), ACCOUNTS)
def test_the_last_line_says_what_the_components_needed(
    account: MissionEnded | MissionEnding | LinkError,
    words: str,
    answer_s: float,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    with subprocess.Popen(["sleep", "60"]) as launcher:

        class Ending:
            source = "ui_console/down-1"

            @classmethod
            async def open_when_up(cls, *_given: Any) -> Ending:
                return cls()

            def publish(self, *_given: Any) -> None: ...

            async def ask(self, _address: str, question: Message, *_given: Any, within_s: float) -> Message:
                if answer_s > within_s:
                    raise ReplyTimeout(f"no answer within {within_s} s")
                if isinstance(question, EndMission) and not isinstance(account, MissionEnding):
                    return MissionEnding()
                launcher.terminate()
                if isinstance(account, LinkError):
                    raise account
                return account

            async def close(self) -> None: ...

        found = RunFile("m", "unixsock-stream/nowhere", launcher.pid, 0.0, 1.0, "base", "m.xml")
        monkeypatch.setattr(detached, "ZenohBus", Ending)
        monkeypatch.setattr(run_files, "find", lambda _mission: found)
        assert asyncio.run(detached.take_down("m")) == 0
    assert capsys.readouterr().err == f"{words}\n"
