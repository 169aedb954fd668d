"""The guide ``docs/how-to/add-a-device.md``: a device that nobody foresaw is made of its text, word by word."""

from __future__ import annotations

import importlib
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from pool_on_local_network import ARC_CLASSES, RC_CLASSES, Pool, a_pool

from backbone.bus.clock import run_virtual
from backbone.component.abilities import ValueKind
from backbone.dependency_database.messages import Resource
from backbone.mission.reader import read_mission
from resource_pool.arc_client import PathNode, claim_parameters
from resource_pool.commands import WrongCommand
from resource_pool.drivers.interface import UnknownDriver
from resource_pool.messages import SwappedOut
from ui_console.model.arc_kinds import Sight, arc_kind

GUIDE = (Path(__file__).parents[2] / "docs/how-to/add-a-device.md").read_text()
MOST_RC_LINES, MOST_ARC_LINES = 40, 25
HORN = "my_lab.siren:PrintedHorn"


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", GUIDE, re.S)


def code_lines(text: str) -> int:
    return sum(bool(line.strip()) for line in text.splitlines())


@pytest.fixture
def my_lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Write the package of the guide, and import it."""
    rc, driver, arcs, _use = blocks("python")
    package = tmp_path / "my_lab"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "siren.py").write_text(f"{rc}\n\n{driver}")
    (package / "arcs.py").write_text(arcs)
    monkeypatch.syspath_prepend(tmp_path)
    siren, kinds = importlib.import_module("my_lab.siren"), importlib.import_module("my_lab.arcs")
    monkeypatch.setitem(RC_CLASSES, "siren", siren.Siren)
    monkeypatch.setitem(ARC_CLASSES, "siren_alone", kinds.SirenArc)
    monkeypatch.setitem(ARC_CLASSES, "loud_drive", kinds.LoudDriveArc)
    yield siren
    for name in [name for name in sys.modules if name.partition(".")[0] == "my_lab"]:
        del sys.modules[name]


def said(pool: Pool) -> list[str]:
    events = [event.what for event in pool.running["siren1"].story.of("siren1")]
    return [what for what in events if what.startswith(("sounds", "is silent"))]


def test_it_takes_few_lines() -> None:
    rc, _driver, arcs, _use = blocks("python")
    print(f"RC {code_lines(rc)} lines, two ARCs {code_lines(arcs)} lines, consoles 0 lines")
    assert code_lines(rc) <= MOST_RC_LINES
    assert code_lines(arcs) <= MOST_ARC_LINES


def test_the_mission_file_of_the_guide_is_sound_and_consoles_know_what_to_draw(tmp_path: Path, my_lab: Any) -> None:
    types, _, resource = blocks("xml")[0].partition("…")
    robot = """
      <resource type="command_radio" name="radio" sharable="true"/>
      <resource type="scout" name="scout1"><uses type="command_radio" name="radio"/>
        <parameter name="network_id" value="1"/></resource>"""
    world = '<world name="world" type="simulated_world"><room width-m="4" depth-m="4"/>'
    file = tmp_path / "mission.xml"
    file.write_text(
        f'<mission name="loud" priority="1">{types}<resources>{resource}{robot}</resources>'
        f'{world}<robot name="scout1" x-m="1" y-m="1"/></world></mission>'
    )
    mission = read_mission(file)
    by_name = {one.name: one for one in mission.types}
    [sound, hush] = by_name["siren"].abilities.commands
    assert (sound.word, hush.word, hush.fields) == ("sound", "hush", [])
    [pitch] = sound.fields
    assert (pitch.kind, pitch.unit, pitch.least, pitch.most, pitch.default) == (ValueKind.NUMBER, "Hz", 100, 4000, 440)
    assert [form.roles for form in by_name["siren_alone"].abilities.commands] == [["siren"], ["siren"]]
    assert arc_kind("siren1", Sight.PICTURES, mission.types, mission.resources) == "siren_alone"


@pytest.mark.parametrize("wrong", ["def tone", "async def tune"])
def test_a_driver_whose_tone_is_missing_or_not_awaited_is_refused(my_lab: Any, wrong: str) -> None:
    _rc, driver, _arcs, _use = blocks("python")
    exec(driver.replace("async def tone", wrong), vars(my_lab))  # noqa: S102  the guide's own text, changed in a word
    with pytest.raises(UnknownDriver, match="tone"):
        my_lab.Siren.driver_options(HORN)


def test_one_person_at_a_time_sounds_it_and_it_is_silent_afterwards(local_mission: Any, my_lab: Any) -> None:
    async def scene() -> None:
        async with a_pool(local_mission, ["siren1"], hardware=[Resource("siren1", "siren", driver=HORN)]) as pool:
            owner = await pool.owner("alarm")
            arc = owner.know("alarm-siren_alone")
            path = [PathNode("local", 10), PathNode("alarm", 1)]
            given = claim_parameters(owner.address, path=path, minimum_runtime_s=1.0, wish={"robot": "siren1"})
            await pool.start(ARC_CLASSES["siren_alone"], arc.arc, msgspec.to_builtins(given), kind="siren_alone")
            granted = await arc.wait_granted()
            assert granted.robot == "siren1"
            assert (await arc.command(my_lab.Sound(880.0))).values == {"pitch_hz": 880.0}
            assert (await arc.give("sound", {})).values == {"pitch_hz": 440.0}
            with pytest.raises(WrongCommand, match="4000"):
                await arc.give("sound", {"pitch_hz": 20_000.0})
            await arc.idle()
            await pool.clock.sleep_s(1.0)
            with pytest.raises(SwappedOut):
                await arc.command(my_lab.Hush())
            assert said(pool) == ["sounds at 880 Hz", "sounds at 440 Hz", "is silent"]

    run_virtual(scene())
