"""``scout-backbone experiment`` as it is typed."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from backbone.command_line.cli import app
from backbone.mission.reader import read_mission
from mission_control.laboratory.experiments.plot import NoPlotting, require_plotting


def typed(*words: str) -> Result:
    return CliRunner().invoke(app, ["experiment", *words])


def surveillance(*words: str) -> Result:
    return typed("surveillance", "--jobs", "1", *words)


@pytest.mark.parametrize("words", [["--help"], ["surveillance", "--help"], ["load", "--help"], ["servoing", "--help"]])
def test_help_names_what_there_is(words: Sequence[str]) -> None:
    told = typed(*words)
    assert told.exit_code == 0
    assert "--trials" in told.output or "surveillance" in told.output


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--extra", "99"], "extra"),
        (["--active", "0"], "active"),
        (["--channels", "9"], "channels"),
        (["--policy", "best"], "policy"),
        (["--trials", "0"], "trials"),
    ],
)
def test_what_is_impossible_ends_with_2_and_says_why(words: list[str], why: str) -> None:
    told = surveillance(*words)
    assert told.exit_code == 2
    assert why in told.output


def test_a_condition_s_mission_file_is_printed_and_has_no_fault(tmp_path: Path) -> None:
    told = surveillance("--mission-file", "--extra", "2", "--policy", "adaptive")
    assert told.exit_code == 0
    file = tmp_path / "mission.xml"
    file.write_text(told.stdout)
    assert len(read_mission(file).behaviors) == 2


def test_json_is_one_object_that_the_same_seed_gives_again() -> None:
    def again() -> dict[str, object]:
        told = surveillance("--extra", "0", "--noise", "0", "--trials", "1", "--json")
        assert told.exit_code == 0, told.output
        found: dict[str, object] = json.loads(told.stdout)
        assert isinstance(found.pop("wall_s"), float)
        return found

    first = again()
    assert first == again()
    assert {"conditions", "geometry", "seed", "simulated_s", "sound"} == set(first)
    (row,) = first["conditions"]  # type: ignore[misc]
    wanted = {"active", "extra", "channels", "policy", "trials", "detected", "rate", "interval95", "predicted"}
    assert wanted <= set(row)


def test_the_table_shows_what_the_paper_says() -> None:
    told = surveillance("--extra", "0", "--trials", "1")
    assert told.exit_code == 0, told.output
    assert "80 %" in told.stdout
    assert "58% - 92%" in told.stdout


def test_a_picture_is_drawn_or_its_library_is_named(tmp_path: Path) -> None:
    file = tmp_path / "rates.png"
    told = surveillance("--extra", "0", "--noise", "0", "--trials", "1", "--plot", str(file))
    try:
        require_plotting()
    except NoPlotting:
        assert told.exit_code == 2
        assert "scout-backbone[plot]" in told.output
    else:
        assert told.exit_code == 0, told.output
        assert file.read_bytes().startswith(b"\x89PNG")


def test_a_picture_that_nothing_can_write_is_refused_before_the_first_trial(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    for name in ("rates.foo", "rates"):
        told = surveillance("--trials", "1000000", "--plot", str(tmp_path / name))
        assert told.exit_code == 2
        assert ".png or .svg" in told.output
    assert not list(tmp_path.iterdir())


def test_a_picture_that_cannot_be_written_takes_no_result_along(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    taken = tmp_path / "new folder" / "rates.png"
    taken.mkdir(parents=True)
    told = surveillance("--extra", "0", "--noise", "0", "--trials", "1", "--json", "--plot", str(taken))
    assert told.exit_code == 6
    assert "cannot be written" in told.output
    assert json.loads(told.stdout)["conditions"][0]["trials"] == 1


def test_a_picture_gets_the_folder_that_it_names(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    file = tmp_path / "new folder" / "rates.png"
    told = surveillance("--extra", "0", "--noise", "0", "--trials", "1", "--plot", str(file))
    assert told.exit_code == 0, told.output
    assert file.exists()


def test_traces_do_not_go_among_those_of_another_run(tmp_path: Path) -> None:
    (tmp_path / "00-0001.jsonl").touch()
    told = surveillance("--extra", "0", "--trials", "1", "--traces", str(tmp_path))
    assert told.exit_code == 2
    assert "is not empty (Name a new folder.)" in told.output
