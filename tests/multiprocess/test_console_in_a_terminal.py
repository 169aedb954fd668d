"""A real terminal session, key by key: a console in tmux on a running mission, from attach to release."""

from __future__ import annotations

import contextlib
import re
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import crashing_console
import pytest
from running_mission import BIN, RunningMission, mission_up

pytestmark = [
    pytest.mark.processes,
    pytest.mark.timeout(300),
    pytest.mark.skipif(shutil.which("tmux") is None, reason="tmux is not installed: there is no terminal to type in"),
]

SHOWN_WITHIN_S = 20.0
COLUMNS, LINES = 130, 40


class Terminal:
    """A terminal that a person could sit at.

    Args:
        socket: Of a tmux server of its own.
        mission: What the command talks to.
    """

    def __init__(self, socket: Path, mission: RunningMission) -> None:
        self._socket, self._mission = socket, mission

    def tmux(self, *words: str) -> str:
        done = subprocess.run(
            ["tmux", "-S", str(self._socket), "-f", "/dev/null", *words],
            env={**self._mission.environment, "TERM": "xterm-256color"},
            capture_output=True,
            text=True,
            timeout=20,
            check=False,
        )
        return done.stdout

    def open(self, *command: str, size: tuple[int, int] = (COLUMNS, LINES), variables: str = "") -> None:
        """Run a command in a new terminal, which says afterwards how it ended and whether it echoes what is typed."""
        words = " ".join(["env", "-u", "COLUMNS", "-u", "LINES", variables, str(BIN / command[0]), *command[1:]])
        after = "echo ENDED WITH $?; stty -a | grep -ow -- '-\\?echo'; cat"
        self.tmux("new-session", "-d", "-x", str(size[0]), "-y", str(size[1]), f"{words}; {after}")

    def press(self, *keys: str) -> None:
        self.tmux("send-keys", *keys)

    def screen(self) -> str:
        return self.tmux("capture-pane", "-p")

    def shows(self, pattern: str, within_s: float = SHOWN_WITHIN_S) -> str:
        """Return the screen once it shows this."""
        deadline = time.monotonic() + within_s
        while time.monotonic() < deadline:
            shown = self.screen()
            if re.search(pattern, shown):
                return shown
            time.sleep(0.1)
        raise AssertionError(f"{pattern!r} is not shown\n{self.screen()}\n{self._mission.story()}")


@contextlib.contextmanager
def terminal(mission: RunningMission, folder: Path) -> Iterator[Terminal]:
    made = Terminal(folder / "tmux", mission)
    try:
        yield made
    finally:
        made.tmux("kill-server")


@pytest.fixture(scope="module")
def mission() -> Iterator[RunningMission]:
    with mission_up() as running:
        yield running


@pytest.fixture(scope="module")
def mission_to_stop() -> Iterator[RunningMission]:
    """Bring up one whose robots a test may leave stopped."""
    with mission_up() as running:
        yield running


def holder(mission: RunningMission, robot: str) -> str:
    found: dict[str, Any] = next(rc for rc in mission.status()["rcs"] if rc["rc"] == robot)
    return found["holders"][0]["arc"] if found["holders"] else ""


def lift(screen: Terminal, robot: str) -> None:
    """Lift a stop as a person does: look again if it has just been set anew."""
    deadline = time.monotonic() + SHOWN_WITHIN_S
    while re.search(rf"{robot} +STOPPED", screen.screen()):
        assert time.monotonic() < deadline, screen.screen()
        screen.press("c")
        screen.shows(rf"lift the stop of {robot}\?")
        screen.press("l")
        time.sleep(0.7)  # what came of it is on the screen by then


@pytest.mark.thorough
def test_from_attach_to_release_key_by_key(mission: RunningMission, tmp_path: Path) -> None:
    with terminal(mission, tmp_path) as screen:
        screen.open("scout-console", "attach", "scout3", "--user", "anna", "--mission", mission.name)
        screen.shows(r"you hold scout3")
        screen.shows(r"▀▀▀▀▀▀")
        assert holder(mission, "scout3").startswith("console-")
        screen.press("a", "a", "a")
        screen.press("y")
        screen.shows(r"why scout3\?")
        screen.press("q")
        screen.press("Tab", "Tab", "Tab", "Tab", "Tab")
        screen.shows(r"commands to scout3")
        screen.press("x")
        screen.shows(r"scout3 is STOPPED by anna")
        screen.press("x", "x")
        screen.shows(r"STOPPED by anna")
        lift(screen, "scout3")
        screen.shows(r"you hold scout3")
        screen.press("2")
        screen.shows(r"you hold scout2")
        assert holder(mission, "scout2").startswith("console-")
        assert not holder(mission, "scout3").startswith("console-")
        screen.press("r")
        screen.shows(r"you hold no robot")
        screen.press("q")
        screen.shows(r"ENDED WITH 0")
    told = "\n".join(mission.lines)
    for line in ("scout3: was taken over by anna", "was stopped", "may move again", "scout3: was given back by anna"):
        assert line in told, mission.story()


@pytest.mark.thorough
def test_a_monitor_holds_nothing_asks_for_nothing_and_can_still_stop_all_robots(
    mission: RunningMission, tmp_path: Path
) -> None:
    with terminal(mission, tmp_path) as screen:
        screen.open("scout-console", "monitor", "--user", "ben", "--mission", mission.name)
        screen.shows(r"watching; you hold no robot")
        screen.shows(r"timeline")
        screen.press("t", "w", "r")
        requests = mission.status()["requests"]
        assert not [one for one in requests if one["owner"].startswith("ui_console/")]
        screen.press("X")
        screen.shows(r"STOPPED by ben")
        screen.press("BTab", "BTab", "BTab")
        for robot in ("scout1", "scout2", "scout3"):
            lift(screen, robot)
            screen.press("]")
        assert "STOPPED" not in screen.screen()
        screen.press("q")
        screen.shows(r"ENDED WITH 0")


TERMINALS = ["TERM=xterm-256color", "TERM=vt100", "TERM=dumb", "NO_COLOR=1", "TEXTUAL_THEME=textual-light"]
SIZES = [(80, 24), (120, 40), (200, 60)]
COMMANDS = {
    "attach": ["attach", "scout3"],
    "pendant": ["attach", "scout3", "--profile", "pendant"],
    "monitor": ["monitor"],
}
KEYS_OF_A_CONSOLE = [
    *"abcdefghijklmnoprstuvwyzABCDEFGHIJKLMNOPQRSTUVWYZ0123456789+-=?[]/<>.,",
    *("Up", "Down", "Left", "Right", "Space", "Tab", "BTab", "PPage", "NPage", "F1", "BSpace", "DC", "Home", "End"),
    *("x", "X"),
]
"""All but those that leave."""
ESCAPE_IS_TOLD_S = 0.15  # a terminal tells escape from the begin of another key by a pause


def press_all_twice(screen: Terminal, keys: list[str]) -> None:
    """Press each key twice at once, then answer twice and close what it opened."""
    for key in keys:
        screen.press(key, key, "Enter", "Enter", "Escape")
        time.sleep(ESCAPE_IS_TOLD_S)
        screen.press("Escape")
        time.sleep(ESCAPE_IS_TOLD_S)
        shown = screen.screen()
        assert "ENDED WITH" not in shown, f"{key} twice ended it\n{shown}"


def ended_well(screen: Terminal, code: int) -> None:
    """Check that the program ended with this code, without a traceback, and gave the terminal back as it was."""
    shown = screen.shows(rf"ENDED WITH {code}\n-?echo")
    assert re.search(r"^echo$", shown, re.MULTILINE), shown
    assert "Traceback" not in shown
    assert screen.tmux("display-message", "-p", "#{alternate_on}").strip() == "0"


def every_terminal() -> list[tuple[str, str, tuple[int, int]]]:
    """Return each console that drives in each terminal at each size, the others in each terminal at one size."""
    others = [name for name in COMMANDS if name != "attach"]
    return [("attach", variables, size) for variables in TERMINALS for size in SIZES] + [
        (name, variables, SIZES[number % len(SIZES)])
        for shift, name in enumerate(others)
        for number, variables in enumerate(TERMINALS, shift)
    ]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "variables", "size"), every_terminal(), ids=str)
def test_no_key_pressed_twice_ends_a_console_in_any_terminal(
    mission_to_stop: RunningMission, tmp_path: Path, name: str, variables: str, size: tuple[int, int]
) -> None:
    with terminal(mission_to_stop, tmp_path) as screen:
        command = ["scout-console", *COMMANDS[name], "--user", "anna", "--mission", mission_to_stop.name]
        screen.open(*command, size=size, variables=variables)
        screen.shows("STOP ALL")  # what is held depends on the keys before: they may have left stops
        press_all_twice(screen, KEYS_OF_A_CONSOLE)
        screen.press("q")
        ended_well(screen, 0)


@pytest.mark.thorough
@pytest.mark.parametrize("variables", TERMINALS)
def test_a_console_is_drawn_in_any_terminal_and_ctrl_c_ends_it(
    mission: RunningMission, tmp_path: Path, variables: str
) -> None:
    with terminal(mission, tmp_path) as screen:
        command = ["scout-console", "attach", "scout3", "--user", "anna", "--mission", mission.name]
        screen.open(*command, size=(80, 24), variables=variables)
        screen.shows(r"you hold scout3")
        screen.press("p")
        screen.shows(r"which robot\?")
        screen.press("Down", "Enter")  # from its own, the last, to the first
        screen.shows(r"you hold scout1")
        screen.press("C-c")
        ended_well(screen, 130)


@pytest.mark.thorough
def test_a_console_that_crashes_gives_its_robot_back_and_the_terminal_and_says_so_by_its_exit_code(
    mission: RunningMission, tmp_path: Path
) -> None:
    with terminal(mission, tmp_path) as screen:
        words = ["scout-console", "attach", "scout3", "--user", "anna", "--mission", mission.name]
        screen.open("python", crashing_console.__file__, *words)
        screen.shows(r"you hold scout3")
        screen.press("j")
        shown = screen.shows(r"ENDED WITH 1\n-?echo")
        assert not holder(mission, "scout3").startswith("console-")
        assert "broken on purpose" in shown
        assert re.search(r"^echo$", shown, re.MULTILINE), shown


@pytest.mark.thorough
def test_a_recording_is_played_and_asked_key_by_key(mission: RunningMission, tmp_path: Path) -> None:
    file = tmp_path / "night.mcap"
    done = mission.command("scout-backbone", "record", "--to", str(file), "--for", "8", "--mission", mission.name)
    assert done.returncode == 0, done.stderr
    with terminal(mission, tmp_path) as screen:
        screen.open("scout-console", "monitor", "--recording", str(file), "--user", "ben")
        screen.shows(r"‖ 1 ×  \d+\.\d s of \d+\.\d s: recording of ")
        screen.press("Space")
        screen.shows(r"▶ 1 × ")
        screen.press("End")
        screen.shows(r"‖ 1 ×  (\d+\.\d) s of \1 s")
        screen.shows(r"timeline[^?]*watch")
        screen.shows(r"robots[^?]*1 scout1[^?]*timeline")  # what a person asks about is on the screen
        screen.press("X")
        screen.shows(r"This is a recording: nothing in it")  # the rest may stand in the next line
        screen.press("y")
        screen.shows(r"why \w+\?")
        screen.press("Enter", "B")
        assert "stop robots" not in screen.shows(r"\d rows")
        screen.press(*"frame")
        screen.shows(r"frames[^\n]*Frame/1")
        screen.press("Enter")
        screen.shows(r"\d messages?, the last")
        screen.press("Escape")
        screen.shows(r"─ timeline ─")
        screen.press("q")
        screen.shows(r"ENDED WITH 0")
