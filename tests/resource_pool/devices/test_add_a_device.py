"""The guide that adds a device, executed: its files make a siren that its holder sounds and that falls silent."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from guide import files_of, lines_of, pool_of, rehearse, written
from pool_on_local_network import Pool, a_pool

from backbone.bus.clock import run_virtual
from backbone.mission.reader import read_mission
from resource_pool.commands import WrongCommand

FILES = files_of("add-a-device.md")
RC_LINES, ARC_LINES = 40, 25  # chosen: more is not done in an hour


@pytest.fixture
def mission(tmp_path: Path) -> Iterator[Path]:
    """Give the guide's mission file; its device can be imported."""
    with written(FILES, tmp_path, "my_devices"):
        yield tmp_path / "siren.xml"


def said(pool: Pool) -> list[str]:
    """Return the siren's events, oldest first."""
    events = [event.what for event in pool.running["siren1"].story.of("siren1")]
    return [what for what in events if what.startswith(("sounds", "is silent"))]


@pytest.mark.parametrize("kind", ["siren_drive", "siren_alone"])
def test_its_holder_sounds_it_and_it_falls_silent_at_the_end_of_the_grant(
    mission: Path, local_mission: Any, kind: str
) -> None:
    async def main() -> None:
        given = pool_of(read_mission(mission), "my_devices")
        async with a_pool(local_mission, ["scout1", "radio", "siren1"], **given) as pool:
            wish = {"siren": "siren1"}
            arc = await pool.arc(await pool.owner("guard"), kind, "", wish=wish)
            await arc.wait_granted()
            applied = await arc.give("sound", {"volume": 0.5, "pitch_hz": 9e9})
            assert (applied.rc, applied.values) == ("siren1", {"volume": 0.5, "pitch_hz": 2000.0})
            with pytest.raises(WrongCommand):
                await arc.give("sound", {"volume": 1.5})
            await arc.idle()
            await pool.clock.sleep_s(1.0)
            assert said(pool) == ["sounds at 2000 Hz, 50%", "is silent"]

    run_virtual(main())


def test_rc_and_arcs_of_the_guide_are_short() -> None:
    assert sorted(FILES) == ["my_devices/arcs.py", "my_devices/siren.py", "siren.xml"]
    assert lines_of(FILES["my_devices/siren.py"]) <= RC_LINES
    assert lines_of(FILES["my_devices/arcs.py"]) <= ARC_LINES


@pytest.mark.processes
def test_the_mission_file_of_the_guide_is_sound(mission: Path) -> None:
    done = rehearse(mission)
    assert (done.returncode, "every request gets its turn" in done.stdout) == (0, True), done.stdout + done.stderr
