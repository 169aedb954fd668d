"""Words that are no command are refused in one form, with the command's own help as the remedy."""

from __future__ import annotations

import sys
from types import ModuleType

import pytest

from backbone.command_line import cli
from ui_console import cli as console_cli


def complaint_of(
    command: ModuleType, typed: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> str:
    """Return what the command prints about these words before it ends with 2."""
    monkeypatch.setattr(sys, "argv", typed.split())
    monkeypatch.setattr(sys.modules["__main__"], "__package__", "")  # else the program's name begins "python -m"
    with monkeypatch.context() as kept:
        for commands in ("registered_commands", "registered_groups"):
            kept.setattr(command.app, commands, list(getattr(command.app, commands)))
        with pytest.raises(SystemExit) as ended:
            command.main()
    assert ended.value.code == 2
    return capsys.readouterr().err


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        ("watch --most 0", "--most: 0 is not between 1 and 1000000 (See 'scout-backbone watch --help'.)"),
        ("watch --most 1.5", "--most: '1.5' is no whole number (See 'scout-backbone watch --help'.)"),
        ("top --for x", "--for: 'x' is no number (See 'scout-backbone top --help'.)"),
        ("record --split 0", "--split: 0.0 is not between 1.0 and 1000000.0 (See 'scout-backbone record --help'.)"),
        ("top --for 1_0", "--for: 1_0 is no number; write it in digits 0 to 9 (See 'scout-backbone top --help'.)"),
        ("watch --most ٢", "--most: ٢ is no number; write it in digits 0 to 9 (See 'scout-backbone watch --help'.)"),
        ("recording info", "FILE.mcap is missing (See 'scout-backbone recording info --help'.)"),
        ("recording info a b", "too many arguments: b (See 'scout-backbone recording info --help'.)"),
        ("statu", "there is no command statu (did you mean 'status', 'start'?) (See 'scout-backbone --help'.)"),
        ("top --jso", "there is no option --jso (did you mean --for, --json?) (See 'scout-backbone top --help'.)"),
        ("experiment bogus", "there is no command bogus (See 'scout-backbone experiment --help'.)"),
        ("recording bogus", "there is no command bogus (See 'scout-backbone recording --help'.)"),
        ("top --bogus", "there is no option --bogus (See 'scout-backbone top --help'.)"),
        (
            "compare a b c",
            "two recordings are compared; more or one only with --detect (See 'scout-backbone compare --help'.)",
        ),
        (
            "replay a --without b --from 5",
            "--from: no effect with --without NAME, except rc_manager (See 'scout-backbone replay --help'.)",
        ),
        (
            "replay a --without b --speed 1 --step --keys c --mission d",
            "--speed, --step, --keys, --mission: no effect with --without NAME (See 'scout-backbone replay --help'.)",
        ),
        (
            "replay a --without rc_manager --class b:C --tolerance x=0",
            "--class, --tolerance: no effect with --without rc_manager (See 'scout-backbone replay --help'.)",
        ),
    ],
)
def test_wrong_words_are_a_refusal_with_a_remedy(
    typed: str, told: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert complaint_of(cli, f"scout-backbone {typed}", monkeypatch, capsys) == f"refused [usage.words]: {told}\n"


def test_faults_that_a_command_of_the_console_finds_have_the_same_form(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    told = "refused [usage.words]: --key belongs to a --certificate (See 'scout-console serve --help'.)\n"
    assert complaint_of(console_cli, "scout-console serve --key k", monkeypatch, capsys) == told
