"""``scout-console serve --design`` refuses early and says what to do; no mission needs to be up."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from free_ports import free_port
from typer.testing import CliRunner

from ui_console.cli import app
from ui_console.design.keeping import path_of_draft


def serve(file: Path, *more: str) -> tuple[int, str]:
    done = CliRunner().invoke(app, ["serve", "--design", str(file), "--port", "0", *more])
    assert done.stdout == "", "no token for what is not served"
    return done.exit_code, done.stderr


def test_a_file_that_is_no_xml_is_told_as_check_tells_it(tmp_path: Path) -> None:
    file = tmp_path / "mission.xml"
    file.write_text("<mission")
    code, told = serve(file)
    assert code == 3
    assert f"{file}:1:1: not well-formed XML" in told


def test_a_draft_that_cannot_be_read_is_refused_and_left_alone(tmp_path: Path) -> None:
    kept = path_of_draft(str(tmp_path / "mission.xml"))
    kept.write_text("{}")
    code, told = serve(tmp_path / "mission.xml")
    assert code == 5
    assert "design.draft_unreadable" in told
    assert kept.read_text() == "{}"


def test_a_folder_that_is_not_there_is_refused_before_anything_is_built(tmp_path: Path) -> None:
    code, told = serve(tmp_path / "no" / "mission.xml")
    assert code == 5
    assert "is no folder" in told


@pytest.mark.parametrize("folder", [".", "..", "/", "ui_console"])
def test_a_folder_in_place_of_a_mission_file_is_refused(folder: str) -> None:
    code, told = serve(Path(folder))
    assert code == 5
    assert "is a folder" in told


@pytest.mark.parametrize("more", [["--mission", "iros2001"], ["--connect", "tcp/127.0.0.1:1"]])
def test_a_mission_that_is_up_is_not_designed(tmp_path: Path, more: list[str]) -> None:
    code, told = serve(tmp_path / "mission.xml", *more)
    assert code == 2
    assert "--design" in told


def test_a_port_that_is_taken_is_refused(tmp_path: Path) -> None:
    code, told = serve(tmp_path / "mission.xml", "--host", "198.51.100.1")
    assert code == 5
    assert "--port" in told


@pytest.mark.parametrize("words", [[], ["guard.xml"], ["--new", "guard.xml"]])
def test_the_command_of_the_terminals_designer_is_refused_and_names_the_page(words: list[str]) -> None:
    done = CliRunner().invoke(app, ["design", *words])
    assert done.exit_code == 2
    assert f"serve --design {'guard.xml' if words else 'mission.xml'}" in done.stderr
    assert "design" not in CliRunner().invoke(app, ["--help"]).output.replace("designer", "").replace("--design", "")


@pytest.mark.processes
def test_the_designer_loads_neither_opencv_nor_mujoco_nor_textual() -> None:
    check = (
        "import sys, ui_console.design.server;sys.exit(', '.join({'cv2', 'textual', 'mujoco'} & set(sys.modules)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", check], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.thorough
@pytest.mark.processes
def test_a_designer_that_begins_again_at_its_port_has_the_same_token(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "runtime"))
    (tmp_path / "runtime").mkdir()
    port = str(free_port())
    command = [
        sys.executable,
        "-m",
        "ui_console.cli",
        "serve",
        "--design",
        str(tmp_path / "mission.xml"),
        "--port",
        port,
    ]
    told = []
    for more in ([], [], ["--new-tokens"]):
        process = subprocess.Popen([*command, *more], stdout=subprocess.PIPE, text=True)
        try:
            assert process.stdout is not None
            told.append(process.stdout.readline())
            process.send_signal(signal.SIGTERM)
            assert process.wait(20) == 0
        finally:
            process.kill()
            process.wait(10)
            process.stdout.close()
    assert told[0] == told[1]
    assert told[0].startswith(f"http://127.0.0.1:{port}/#token=")
    assert told[2] != told[0]


@pytest.mark.processes
def test_it_ends_in_good_order_when_interrupted_and_gives_each_designer_a_token(tmp_path: Path) -> None:
    command = [str(Path(sys.executable).parent / "scout-console"), "serve", "--design", str(tmp_path / "mission.xml")]
    process = subprocess.Popen(
        [*command, "--port", "0", "--operator", "anna=1", "--operator", "ben=1"], stdout=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout is not None
        assert [process.stdout.readline().partition(": http://127.0.0.1:")[0] for _ in range(2)] == ["anna", "ben"]
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 130
        assert list(tmp_path.iterdir()) == []
    finally:
        if process.poll() is None:
            process.kill()
            process.wait(10)
        assert process.stdout is not None
        process.stdout.close()
