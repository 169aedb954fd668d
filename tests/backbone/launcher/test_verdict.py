"""Talk and verdict on the pipe between a launcher in the background and the command that started it."""

from __future__ import annotations

import os
from typing import Any, NoReturn, cast

import pytest

from backbone.command_line import mission_console
from backbone.command_line.unusable_file import FileUnusable, open_output
from backbone.launcher.verdict import VerdictPipe, await_verdict


def test_the_verdict_is_the_last_that_is_read() -> None:
    reading, writing = os.pipe()
    pipe = VerdictPipe(os.fdopen(writing, "w", encoding="utf-8"))
    pipe.talk("mission m comes up")
    pipe.decide(6)
    pipe.talk("too late")
    pipe.decide(0)
    said: list[str] = []
    with os.fdopen(reading, encoding="utf-8") as lines:
        assert await_verdict(lines, said.append) == 6
    assert said == ["mission m comes up"]


@pytest.mark.parametrize("lines", [[], ['{"type":"talk","line":"comes up"}']])
def test_a_pipe_that_ends_without_a_verdict_has_none(lines: list[str]) -> None:
    assert await_verdict(lines, lambda _line: None) is None


def test_nobody_who_reads_any_more_is_no_bug_of_the_launcher() -> None:
    reading, writing = os.pipe()
    pipe = VerdictPipe(os.fdopen(writing, "w", encoding="utf-8"))
    os.close(reading)
    pipe.talk("mission m comes up")
    pipe.decide(0)


async def test_a_launcher_that_fails_says_why_before_it_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond the limit of threads the command that waits said only "ended without a verdict: exit code 1"."""

    async def run_mission(*_given: object) -> NoReturn:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(mission_console, "run_mission", run_mission)
    reading, writing = os.pipe()
    pipe, nothing = VerdictPipe(os.fdopen(writing, "w", encoding="utf-8")), cast("Any", None)
    with pytest.raises(RuntimeError):
        await mission_console.bring_up_on_console(nothing, nothing, live=False, verdict=pipe)
    said: list[str] = []
    with os.fdopen(reading, encoding="utf-8") as lines:
        assert await_verdict(lines, said.append) == 1
    assert "the launcher failed: RuntimeError: can't start new thread" in said[0]


@pytest.mark.parametrize("kind", ["closed", "negative", "only for reading"])
def test_a_descriptor_that_cannot_be_written_is_refused_with_a_remedy(kind: str) -> None:
    reading, writing = os.pipe()
    os.close(writing)
    descriptor = {"closed": writing, "negative": -1, "only for reading": reading}[kind]
    try:
        with pytest.raises(FileUnusable, match=f"descriptor {descriptor}: Bad file descriptor"):
            open_output(descriptor)
    finally:
        os.close(reading)
