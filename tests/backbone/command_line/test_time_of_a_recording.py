"""A time after the end of a recording is refused: what was then is not known."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_recordings import SCOUT, Said, recorded
from typer.testing import CliRunner

from backbone.command_line.cli import app
from backbone.command_line.opened_recording import NothingSelected
from backbone.command_line.recording_work import print_messages
from backbone.command_line.replaying import Playing, decide_anew, play, print_reasons_at
from backbone.component.messages import ComponentState, LifeState
from backbone.keys import Conversation
from backbone.launcher.endings import ExitCode
from backbone.recording.decisions import NotRecorded
from backbone.recording.playback import NoSuchTime

END_S, SHOWN_END_S, AFTERWARDS_S = 2.0006, 2.001, 2.0015


@pytest.fixture
def night(tmp_path: Path) -> Path:
    path = tmp_path / "night.mcap"
    state = ComponentState(SCOUT, "scout", "base", 7, LifeState.READY, 0.5, "drives")
    path.write_bytes(recorded([Said(at_s, SCOUT, Conversation.STATUS, state) for at_s in (1.0, END_S)]).getvalue())
    return path


@pytest.mark.parametrize("at_s", [None, 1.0, END_S, SHOWN_END_S])
async def test_until_its_end_as_info_prints_it_reasons_are_told(
    night: Path, at_s: float | None, capsys: pytest.CaptureFixture[str]
) -> None:
    assert await print_reasons_at(night, "scout1", at_s, as_json=False) is ExitCode.DONE
    assert "scout1 is ready on base: drives" in capsys.readouterr().out


@pytest.mark.parametrize("at_s", [AFTERWARDS_S, 1000.0])
async def test_afterwards_no_reasons_are_told_and_nothing_is_played(night: Path, at_s: float) -> None:
    with pytest.raises(NoSuchTime, match=r"ends at 2\.001 s"):
        await print_reasons_at(night, "scout1", at_s, as_json=False)
    with pytest.raises(NoSuchTime, match=r"ends at 2\.001 s"):
        await play(night, Playing("late", at_s, 1.0, is_stepped=False, keys=()))
    with pytest.raises(NoSuchTime, match=r"ends at 2\.001 s") as refused:
        await decide_anew(night, at_s, {}, as_json=False)
    assert refused.value.remedy == "Name an earlier time."


@pytest.mark.parametrize(("since_s", "remedy"), [(1.5, "Choose an earlier time"), (0.0, "Record from the begin")])
async def test_the_remedy_for_a_missing_schedule_depends_on_the_time(night: Path, since_s: float, remedy: str) -> None:
    with pytest.raises(NotRecorded) as refused:
        await decide_anew(night, since_s, {}, as_json=False)
    assert refused.value.remedy.startswith(remedy)


@pytest.mark.parametrize("command", ["print", "story"])
def test_times_between_which_nothing_can_be_are_wrong_usage(night: Path, command: str) -> None:
    wrong = CliRunner().invoke(app, ["recording", command, str(night), "--since", "10", "--until", "5"])
    assert wrong.exit_code == ExitCode.USAGE
    assert "--until 5 comes before --since 10" in wrong.output
    assert CliRunner().invoke(app, ["recording", command, str(night), "--since", "1", "--until", "1"]).exit_code == 0


async def test_where_nothing_was_sent_no_message_is_printed_and_said(
    night: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    await print_messages(night, (), AFTERWARDS_S, None, 1, as_json=False)
    assert capsys.readouterr() == ("", "no message\n")


async def test_what_is_left_out_is_said(night: Path, capsys: pytest.CaptureFixture[str]) -> None:
    await print_messages(night, (), 0.0, None, 1000, as_json=False)
    count = len(capsys.readouterr().out.splitlines())
    for most, says in ((count, ""), (count - 1, "later messages are left out; see --most, --since and --keys\n")):
        await print_messages(night, (), 0.0, None, most, as_json=False)
        shown = capsys.readouterr()
        assert (len(shown.out.splitlines()), shown.err) == (most, says)


async def test_keys_that_no_message_has_are_not_played(night: Path) -> None:
    with pytest.raises(NothingSelected, match=r"no message whose key matches \*/redings"):
        await play(night, Playing("quiet", None, 1.0, is_stepped=False, keys=("*/redings",)))
