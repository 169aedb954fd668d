"""Words that are no command are refused in one form, with the command's own help as the remedy."""

from __future__ import annotations

import sys

import pytest

from backbone.command_line import cli
from ui_console import cli as console_cli


@pytest.mark.parametrize(
    ("typed", "told"),
    [
        ("watch --most 0", "--most: 0 is not between 1 and 1000000 (See 'scout-backbone watch --help'.)"),
        ("watch --most 1.5", "--most: '1.5' is no whole number (See 'scout-backbone watch --help'.)"),
        ("top --for x", "--for: 'x' is no number (See 'scout-backbone top --help'.)"),
        ("record --split 0", "--split: 0.0 is not between 1.0 and 1000000.0 (See 'scout-backbone record --help'.)"),
        ("recording info", "FILE.mcap is missing (See 'scout-backbone recording info --help'.)"),
        ("recording info a b", "too many arguments: b (See 'scout-backbone recording info --help'.)"),
        ("recording bogus", "there is no command bogus (See 'scout-backbone recording --help'.)"),
        ("top --bogus", "there is no option --bogus (See 'scout-backbone top --help'.)"),
        (
            "compare a b c",
            "two recordings are compared; more or one only with --detect (See 'scout-backbone compare --help'.)",
        ),
    ],
)
def test_wrong_words_are_a_refusal_with_a_remedy(
    typed: str, told: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["scout-backbone", *typed.split()])
    monkeypatch.setattr(sys.modules["__main__"], "__package__", "")  # else the program's name begins "python -m"
    with monkeypatch.context() as kept:
        for commands in ("registered_commands", "registered_groups"):
            kept.setattr(cli.app, commands, list(getattr(cli.app, commands)))
        with pytest.raises(SystemExit) as ended:
            cli.main()
    assert ended.value.code == 2
    assert capsys.readouterr().err == f"refused [usage.words]: {told}\n"


def test_faults_that_a_command_of_the_console_finds_have_the_same_form(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["scout-console", "serve", "--key", "k"])
    monkeypatch.setattr(sys.modules["__main__"], "__package__", "")
    with monkeypatch.context() as kept:
        for commands in ("registered_commands", "registered_groups"):
            kept.setattr(console_cli.app, commands, list(getattr(console_cli.app, commands)))
        with pytest.raises(SystemExit) as ended:
            console_cli.main()
    assert ended.value.code == 2
    told = "refused [usage.words]: --key belongs to a --certificate (See 'scout-console serve --help'.)"
    assert capsys.readouterr().err.splitlines() == [told]
