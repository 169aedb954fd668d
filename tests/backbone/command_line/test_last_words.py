"""What a command prints last is true: how a mission ends, which files are left, which attribute is unknown."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.command_line import ordering
from backbone.command_line.attributes import ShownAttributes, WrongAttribute
from backbone.command_line.mission_console import ConsoleObserver
from backbone.command_line.ordering import print_attributes
from backbone.command_line.where import Where
from backbone.recording.files import RecordingFiles


class Waiting:
    """The command that waits in ``up --detach``."""

    def talk(self, line: str) -> None:
        pass

    def decide(self, exit_code: int) -> None:
        raise KeyError(exit_code)


def test_a_detached_mission_does_not_tell_of_keys_that_nobody_can_press() -> None:
    printed = io.StringIO()

    async def main() -> None:
        waiting: Any = Waiting()
        console = ConsoleObserver(Console(file=printed), live=False, verdict=waiting)
        with pytest.raises(KeyError):
            await console.up(LocalNetwork("m").join("backbone/launcher", VirtualClock()), VirtualClock())

    run_virtual(main())
    assert printed.getvalue() == "all ready; end with 'scout-backbone down'\n"


def test_the_oldest_file_that_is_left_is_known(tmp_path: Path) -> None:
    files = RecordingFiles(tmp_path / "night.mcap", keep=2)
    assert files.oldest == tmp_path / "night.mcap"
    files.open_next()()
    files.open_next()()
    files.close()
    assert files.oldest == tmp_path / "night-2.mcap"
    assert files.oldest.exists()
    files.oldest.unlink()
    assert files.oldest == tmp_path / "night-3.mcap", "a person deleted the second"


def test_an_unknown_attribute_is_refused_also_as_json(monkeypatch: pytest.MonkeyPatch) -> None:
    async def shown(_bus: object, name: str) -> ShownAttributes:
        return ShownAttributes(name, [], {"capacity": 1.0})

    class Connected:
        async def __aenter__(self) -> tuple[None, None]:
            return None, None

        async def __aexit__(self, *_error: object) -> None:
            pass

    monkeypatch.setattr(ordering, "connected", lambda _where: Connected())
    monkeypatch.setattr(ordering, "attributes_of", shown)
    with pytest.raises(WrongAttribute, match="radio has no bla"):
        run_virtual(print_attributes(Where("m", None, None), "radio", "bla", as_json=True))
