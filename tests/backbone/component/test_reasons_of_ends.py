"""The reason for which a component ends, as its feedback and its log say it."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable

import msgspec
import pytest
from component_stage import TOWER, Stage, TooSteep, live

from backbone.component.component import CALM_S
from backbone.component.process import EXIT_BUG, EXIT_REFUSED, cause_in_log, exit_code_of, refusal_in_log
from backbone.component.story import MAX_FEEDBACK_LENGTH
from backbone.wire import WIRE_VERSION, Envelope, write


def test_a_bug_whose_text_fails_ends_it_too() -> None:
    class Ugly(Exception):
        def __str__(self) -> str:
            raise LookupError

    async def fall() -> None:
        raise Ugly

    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        stage.walker.start_task(fall(), "fall")
        with pytest.raises(Ugly):
            await life
        assert stage.states[-1].feedback == "Ugly: its __str__ raised LookupError"

    live(law())


@pytest.mark.parametrize(
    "silence",
    [
        logging.disable,
        lambda: setattr(logging.getLogger("backbone.component.process"), "disabled", True),
        lambda: logging.getLogger("backbone.component.process").setLevel(logging.CRITICAL + 1),
    ],
    ids=["all logging", "its logger", "its level"],
)
def test_a_component_that_switched_logging_off_says_why_it_ends(
    silence: Callable[[], None], caplog: pytest.LogCaptureFixture
) -> None:
    """As ``logging.config.dictConfig`` does by default with all loggers that exist."""
    silence()
    code = exit_code_of(ValueError("boom"), "mission_control/unit")
    assert code == EXIT_BUG
    assert cause_in_log([f"12:00 ERROR x: {line}" for line in caplog.messages], "mission_control/unit", os.getpid())


def test_the_cause_is_found_in_a_log_of_another_format() -> None:
    """``logging.basicConfig(force=True)`` in a module replaces the format."""
    for before in ("", "ERROR:backbone.component.process:"):
        line = f"{before}process 7: rc/x ended by a bug: ValueError: boom"
        assert cause_in_log([line], "rc/x", 7) == "ValueError: boom"


def test_a_complaint_about_a_file_whose_name_is_not_utf8_is_told() -> None:
    """Python names such a file with lone surrogates, which no message can contain."""

    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        stage.walker.report("reads w\udce4ge.png")
        await stage.clock.sleep_s(CALM_S + 0.1)
        stage.walker.fail(FileNotFoundError("w\udce4ge.png"))
        with pytest.raises(FileNotFoundError):
            await life
        await stage.clock.sleep_s(0.1)
        told = [state.feedback for state in stage.states if state.feedback]
        assert told[0] == r"reads w\udce4ge.png"
        assert told[-1] == r"FileNotFoundError: w\udce4ge.png"
        for state in stage.states:
            write(Envelope(WIRE_VERSION, TOWER, 1, 0.0, "", state))

    live(law())


def test_a_long_complaint_is_cut_in_the_feedback() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        stage.walker.fail(ValueError("x" * 10_000))
        with pytest.raises(ValueError, match="xxx"):
            await life
        assert len(stage.states[-1].feedback) == MAX_FEEDBACK_LENGTH

    live(law())


def test_a_refusal_of_several_lines_is_one_line_in_feedback_and_log(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """A refused start quotes a log; its line ends stood in the log of its parent as backslash and n."""

    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        stage.walker.fail(TooSteep("watch: exit code 1\nTraceback:\n  no map", remedy="Mend it."))
        with pytest.raises(TooSteep):
            await life
        assert stage.states[-1].feedback == "TooSteep: watch: exit code 1 (Mend it.) Traceback: no map"

    live(law())
    assert "walker failed: TooSteep: watch: exit code 1 (Mend it.) Traceback: no map" in caplog.text


def test_a_bug_that_quotes_a_lone_surrogate_is_the_one_that_is_told() -> None:
    async def law() -> None:
        stage = Stage(hold="serve")
        life = await stage.begin()
        stage.walker.fail(ValueError("no model caf\udce9"))
        with pytest.raises(ValueError, match="no model"):
            await life
        assert stage.states[-1].feedback == "ValueError: no model caf\\udce9"
        msgspec.msgpack.encode(stage.states[-1])

    live(law())


def test_a_refusal_that_ends_a_component_is_told_with_the_line_of_its_code(caplog: pytest.LogCaptureFixture) -> None:
    with pytest.raises(TooSteep) as raised:
        raise TooSteep("45 degrees")
    assert exit_code_of(raised.value, TOWER) == EXIT_REFUSED
    lines, place = [f" ERROR x: {record.getMessage()}" for record in caplog.records], f"({__file__}, line "
    assert cause_in_log(lines, TOWER, os.getpid()).startswith(f"45 degrees {place}")
    found = refusal_in_log(lines, TOWER)
    assert found is not None
    assert found.detail.startswith(f"45 degrees {place}")
