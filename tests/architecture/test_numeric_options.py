"""Every numeric option of both command lines has a range; what is no number, infinite or beyond it is wrong usage."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest
from typer.main import get_command
from typer.models import OptionInfo

from backbone.command_line.cli import app as backbone_app
from mission_control.laboratory.experiments.cli import app as experiment_app
from ui_console.cli import app as console_app

MISSION_XML = str(Path(__file__).parents[2] / "mission.xml")
APPS = {"scout-backbone": backbone_app, "scout-console": console_app, "experiment": experiment_app}
COMMANDS = {program: get_command(app) for program, app in APPS.items()}
ARGUMENTS = {"check": [MISSION_XML, "--dry-run"], "up": [MISSION_XML]}


def numeric_options() -> Iterator[tuple[str, str, str, bool]]:
    """Yield program, command, option and whether it is whole, for each numeric option."""
    for program, app in APPS.items():
        groups = [(group.name, group.typer_instance) for group in app.registered_groups if group.typer_instance]
        tables = [("", app), *((f"{name} ", table) for name, table in groups)]
        for group, command in [(group, command) for group, table in tables for command in table.registered_commands]:
            assert command.callback is not None
            hints = get_type_hints(command.callback, include_extras=True)
            for name, hint in hints.items():
                kinds = set(_kinds(hint)) & {int, float}
                option = next((each for each in get_args(hint) if isinstance(each, OptionInfo)), None)
                if kinds and option is not None and not option.hidden:
                    flag = (option.param_decls or (f"--{name.replace('_', '-')}",))[0]
                    yield program, group + (command.name or command.callback.__name__), flag, int in kinds


def _kinds(hint: Any) -> Iterator[Any]:
    yield hint
    for inner in get_args(hint):
        yield from _kinds(inner)


OPTIONS = sorted(set(numeric_options()))


def test_there_are_numeric_options() -> None:
    assert len(OPTIONS) > 20


@pytest.mark.parametrize("value", ["1e400", "nan", "inf", "-inf", "-1e12", "1e12"])
@pytest.mark.parametrize(("program", "command", "option", "is_whole"), OPTIONS, ids=str)
def test_a_number_out_of_its_range_is_wrong_usage(
    program: str, command: str, option: str, is_whole: bool, value: str, capsys: pytest.CaptureFixture[str]
) -> None:
    if is_whole and value in ("1e12", "-1e12"):
        value = str(int(float(value)))
    with pytest.raises(SystemExit) as ended:
        COMMANDS[program].main([*command.split(), *ARGUMENTS.get(command, []), option, value], prog_name=program)
    told = capsys.readouterr()
    assert ended.value.code == 2, told
    assert option.lstrip("-") in told.err or "experiment.condition" in told.err
