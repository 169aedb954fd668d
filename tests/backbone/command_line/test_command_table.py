"""The command that the words name is built alone, and nobody sees a difference."""

from __future__ import annotations

import copy
import functools
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any

import pytest
import typer

from backbone.command_line.options import run_table

TABLES = {"scout-backbone": "backbone.command_line.cli", "scout-console": "ui_console.cli"}
COMPLETIONS = {"scout-backbone": "_SCOUT_BACKBONE_COMPLETE", "scout-console": "_SCOUT_CONSOLE_COMPLETE"}


def whole(program: str) -> typer.Typer:
    table: typer.Typer = import_module(TABLES[program]).app
    return table


def a_copy(program: str) -> typer.Typer:
    table = copy.copy(whole(program))
    table.registered_commands = list(table.registered_commands)
    table.registered_groups = list(table.registered_groups)
    return table


def said(
    table: typer.Typer,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    *typed: str,
    run: Callable[[typer.Typer], object] = run_table,
) -> str:
    monkeypatch.setattr(sys, "argv", list(typed))
    monkeypatch.setattr(sys.modules["__main__"], "__package__", "")  # else the program's name begins "python -m"
    with pytest.raises(SystemExit):
        run(table)
    return capsys.readouterr().out


@functools.cache
def built(program: str) -> Any:
    """Return the command that the whole table makes."""
    return typer.main.get_command(whole(program))


EACH = [(program, command) for program in TABLES for command in built(program).commands]


@pytest.mark.parametrize(("program", "command"), EACH)
def test_each_command_is_the_same_alone_as_in_the_whole_table(
    program: str, command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    of_all = said(a_copy(program), monkeypatch, capsys, program, command, "--help", run=lambda _table: built(program)())
    table = a_copy(program)
    assert said(table, monkeypatch, capsys, program, command, "--help") == of_all
    assert len(table.registered_commands) + len(table.registered_groups) == 1


@pytest.mark.parametrize("program", TABLES)
@pytest.mark.parametrize("typed", [[], ["--help"], ["nonsense"], ["--nonsense"], ["-", "why"], [""]])
def test_whoever_names_no_command_sees_them_all(
    program: str, typed: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    table = a_copy(program)
    said(table, monkeypatch, capsys, program, *typed)
    assert len(table.registered_commands) == len(whole(program).registered_commands)


def test_a_version_needs_no_command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    table = a_copy("scout-backbone")
    assert said(table, monkeypatch, capsys, "scout-backbone", "--version").startswith("scout-backbone ")
    assert table.registered_commands == []


@pytest.mark.parametrize(
    ("words", "cursor", "offered"),
    [
        ("scout-backbone wh", "1", {"why"}),
        ("scout-backbone\nre", "1", {"record", "recording", "replay"}),
        ("scout-backbone why", "1", {"why"}),
        ("scout-backbone record re", "2", {"recover"}),
        ("scout-backbone check --d", "2", {"--dry-run"}),
        ("scout-backbone w why", "1", {"watch", "why"}),
    ],
)
def test_a_shell_completes_by_the_command_before_the_cursor(
    words: str, cursor: str, offered: set[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", cursor)
    monkeypatch.setenv(COMPLETIONS["scout-backbone"], "complete_bash")
    assert offered <= set(said(a_copy("scout-backbone"), monkeypatch, capsys, "scout-backbone").split())


def test_a_shell_that_gives_its_line_as_one_text_is_served_too(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("_TYPER_COMPLETE_ARGS", "scout-backbone record ")
    monkeypatch.setenv("_TYPER_COMPLETE_FISH_ACTION", "get-args")
    monkeypatch.setenv(COMPLETIONS["scout-backbone"], "complete_fish")
    assert "recover" in said(a_copy("scout-backbone"), monkeypatch, capsys, "scout-backbone")
