"""What the command line says: help whole, wrong words refused early, names completed from the mission that is up."""

from __future__ import annotations

import os
import re
import socket
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from backbone.command_line.cli import app
from backbone.command_line.options import hub_endpoint
from backbone.command_line.tree_commands import tree
from backbone.component.messages import ComponentState, LifeState
from backbone.component_database.messages import ComponentType, TypeCount
from backbone.errors import HubUnreachable
from backbone.launcher.endings import ExitCode, complaint_of
from backbone.moments import NoMoment
from backbone.naming import Subsystem
from backbone.picture.mission import MissionPicture
from backbone.picture.names import names_in
from backbone.run_names import MissionNames
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import RcView, RequestView, Schedule
from ui_console.cli import app as console_app


@pytest.fixture(autouse=True)
def _no_mission_is_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


@pytest.mark.parametrize("command_line", [app, console_app], ids=["scout-backbone", "scout-console"])
def test_help_tells_every_command_whole(command_line: Any) -> None:
    told = CliRunner().invoke(command_line, ["--help"]).output
    words = " ".join(told.partition("Commands:")[2].split())
    assert "..." not in words
    for command in (one for one in command_line.registered_commands if not one.hidden):
        summary = " ".join((command.callback.__doc__ or "").partition("\n\n")[0].split())
        assert summary in words


@pytest.mark.parametrize("command_line", [app, console_app], ids=["scout-backbone", "scout-console"])
@pytest.mark.parametrize(
    "wrong",
    [
        *("garbage", "tcp/", "tcp/host", "tcp/host:port", "192.0.2.7:7447", "ftp/host:1", ""),
        *("tcp/host:1?", "tcp/host:1#", "tcp/host:1#a=b?c=d", "tcp/#:1", "unixsock-stream//run/m#a?b"),
        *("tcp/192.0.2..7:7447", "tcp/lab..local:7447", "tcp/192.0.2.300:7447", "tcp/[::g]:7447"),
        *("tcp/192.0.2.7:0", "tcp/192.0.2.7:65536"),
        *("udp/192.0.2.7:7447", "quic/192.0.2.7:7447", "ws/192.0.2.7:7447"),
    ],
)
def test_an_endpoint_that_is_none_is_wrong_usage_and_says_how_to_write_one(command_line: Any, wrong: str) -> None:
    command = "status" if command_line is app else "monitor"
    done = CliRunner().invoke(command_line, [command, "--mission", "m", "--connect", wrong])
    assert done.exit_code == 2
    assert "tcp/HOST:PORT" in " ".join(done.output.split())
    assert "Traceback" not in done.output


@pytest.mark.parametrize(
    "right",
    [
        *("tcp/192.0.2.7:7447", "tcp/[::1]:7447", "tcp/[fe80::1%7]:7447", "tcp/lab.local:1"),
        *("tls/lab:1?prio=1-3#a=/b;c=d", "unixsock-stream//run/m/hub"),
    ],
)
def test_an_endpoint_of_a_hub_is_taken(right: str) -> None:
    assert hub_endpoint(right) == right


def test_the_interface_of_an_address_of_one_link_is_numbered_because_zenoh_knows_no_names() -> None:
    [(number, name), *_] = socket.if_nameindex()
    assert hub_endpoint(f"tcp/[fe80::1%{name}]:7447#so_sndbuf=1") == f"tcp/[fe80::1%{number}]:7447#so_sndbuf=1"


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ("tcp/[fe80::1%no-such0]:7447", "no network interface no-such0; 'ip link' lists them"),
        ("tcp/[fe80::1]:7447", "write its interface, too: [fe80::1%eth0]"),
    ],
)
def test_an_address_of_one_link_without_an_interface_of_this_machine_is_wrong_usage(wrong: str, told: str) -> None:
    done = CliRunner().invoke(app, ["status", "--mission", "m", "--connect", wrong])
    assert done.exit_code == 2
    assert told in " ".join(done.output.replace("│", " ").split())


@pytest.mark.parametrize("name", ["x" * 256, os.fsdecode(b"\xff")])
@pytest.mark.parametrize("words", [["why"], ["story"], ["stop"], ["set"]])
def test_a_name_that_no_message_can_contain_is_wrong_usage(words: list[str], name: str) -> None:
    done = CliRunner().invoke(app, [*words, name])
    assert done.exit_code == 2
    assert "255 printable characters" in done.output


def test_a_value_behind_an_equals_sign_is_wrong_usage() -> None:
    done = CliRunner().invoke(app, ["set", "rc_manager", "aging_s=nan"])
    assert done.exit_code == 2
    assert "write the value apart: set rc_manager aging_s nan" in " ".join(done.output.split())


HUB = ["--connect", "tcp/127.0.0.1:1"]


@pytest.mark.parametrize("wrong", ["", "A b", "*", "ä"])
@pytest.mark.parametrize(
    ("command_line", "words", "option"),
    [
        (app, ["status", *HUB], "--mission"),
        (console_app, ["monitor", "--json", *HUB], "--mission"),
        (app, ["creator", *HUB, "--host", "field"], "--mission"),
        (app, ["creator", *HUB, "--mission", "m"], "--host"),
        (app, ["creator", *HUB, "--mission", "m", "--host", "field", "--tag", "radio"], "--tag"),
    ],
    ids=["status", "monitor", "creator of a mission", "creator on a host", "creator with tags"],
)
def test_a_name_that_no_mission_host_or_tag_can_have_is_wrong_usage(
    command_line: Any, words: list[str], option: str, wrong: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("backbone.command_line.options", "backbone.command_line.cli", "ui_console.cli"):
        monkeypatch.setattr(f"{module}.run", lambda _: pytest.fail("the name was taken"))
    done = CliRunner().invoke(command_line, [*words, option, wrong])
    assert done.exit_code == 2
    assert "legal name" in " ".join(done.output.split())


def test_a_machine_whose_recording_no_message_can_name_is_not_offered(tmp_path: Path) -> None:
    path = os.fsdecode(os.fsencode(tmp_path) + b"/r\xfcbe.mcap")
    done = CliRunner().invoke(app, ["creator", *HUB, "--mission", "m", "--host", "field", "--record", path])
    assert done.exit_code == ExitCode.NO_BACKBONE
    assert "refused [run.path]: the path " in done.output


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--without", ""], "--without needs the name of a component"),
        (["--set", "gain=2"], "are for --without NAME"),
        (["--json"], "are for --without NAME"),
        (["--without", "a", "--without", "b", "--set", "gain=2"], "are for a single --without NAME"),
        (["--without", "a", "--without", "rc_manager"], "are for a single --without NAME"),
    ],
)
def test_options_of_a_replay_that_mean_nothing_are_wrong_usage(tmp_path: Path, options: list[str], told: str) -> None:
    recording = tmp_path / "night.mcap"
    recording.touch()
    done = CliRunner().invoke(app, ["replay", str(recording), *options])
    assert done.exit_code == 2
    assert told in " ".join(done.output.replace("│", " ").split())


@pytest.mark.thorough
def test_a_hub_that_is_not_there_is_one_sentence_without_anything_inner() -> None:
    words = ["status", "--mission", "m", "--connect", "unixsock-stream//nowhere/hub"]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 4
    assert re.fullmatch(r"no hub answers at unixsock-stream//nowhere/hub \(.*\)\n", done.stderr)
    line, _ = complaint_of(HubUnreachable("no hub answers at tcp/x:1"))
    assert line.startswith("no hub answers at tcp/x:1 (is the mission up there")


@pytest.mark.parametrize("wrong", ["", "pair.py", "pair:", ":Smoothing", "pair.py:Smoothing!", "../pair:Smoothing"])
def test_a_class_that_is_none_is_wrong_usage_before_any_mission_is_asked(wrong: str) -> None:
    done = CliRunner().invoke(app, ["swap", "smoothing", wrong, "--mission", "m"])
    assert done.exit_code == 2
    assert "package.module:Class" in " ".join(done.output.split())


def test_a_moment_that_is_none_is_wrong_usage() -> None:
    line, code = complaint_of(NoMoment("'soon' is no moment"))
    assert code == ExitCode.USAGE
    assert "14:05" in line


def test_the_commands_of_the_tree_are_told_whole_and_a_file_that_cannot_be_read_is_wrong_usage(tmp_path: Path) -> None:
    told = " ".join(CliRunner().invoke(app, ["tree", "--help"]).output.split())
    for command in tree.registered_commands:
        assert " ".join((command.callback.__doc__ or "").split()) in told
    done = CliRunner().invoke(app, ["tree", "add", str(tmp_path / "none.xml")])
    assert (done.exit_code, "cannot be read" in done.stderr) == (2, True)
    assert CliRunner().invoke(app, ["tree", "save", str(tmp_path / "x.xml")]).exit_code == 4


def component(address: str, kind: str, user: str = "") -> ComponentState:
    return ComponentState(address, kind, "base", 1, LifeState.READY, 0.0, user=user)


def picture() -> MissionPicture:
    found = [
        component("backbone/creator-base", "creator"),
        component("mission_control/seeing", "execution_unit"),
        component("mission_control/watch1", "watch_for_motion"),
        component("ui_console/console-7", "console", "anna"),
        component("ui_console/console-8", "console", "Ben B."),
    ]
    rc = RcView("scout1", "scout", "up", False, 1.0, [], 0, [], is_robot=True)
    request = RequestView(
        "console-7-drive", found[3].address, RequestState.RUNNING, ["scout1"], 0.0, -1.0, -1.0, "", [], 5.0, "", 1
    )
    return MissionPicture("m", 1.0, {one.address: one for one in found}, schedule=Schedule(1.0, [rc], [request], []))


def test_what_can_be_asked_about_is_completed_and_nothing_a_shell_takes_apart() -> None:
    types = [TypeCount(ComponentType("scout", "x:Y", Subsystem.RESOURCE_POOL), 1)]
    assert names_in(picture(), types) == MissionNames(
        ["anna", "base", "console-7", "console-7-drive", "console-8", "creator-base", "scout1", "seeing", "watch1"],
        ["scout1"],
        ["scout1"],
        ["watch1"],
        ["anna"],
        ["scout"],
    )


@pytest.mark.parametrize("words", [["why", ""], ["stop", ""], ["story", "sc"], ["log", "--robot", ""]])
def test_without_a_mission_nothing_is_completed_and_nothing_complained_of(words: list[str]) -> None:
    typed = ["scout-backbone", *words]
    environment = {
        "_SCOUT_BACKBONE_COMPLETE": "complete_bash",
        "COMP_WORDS": " ".join(typed),
        "COMP_CWORD": str(len(typed) - 1),
    }
    done = CliRunner().invoke(app, [], env=environment, prog_name="scout-backbone")
    assert (done.output.strip(), done.exit_code) == ("", 0)


@pytest.mark.parametrize("words", [["check"], ["up", "--headless"]])
def test_the_name_of_a_file_with_faults_controls_no_terminal(words: list[str]) -> None:
    done = CliRunner().invoke(app, [*words, "\x1b[31mred.xml"])
    assert done.exit_code == ExitCode.MISSION_INVALID
    assert done.stdout.startswith("\\x1b[31mred.xml:1:1: cannot be read: ")
