"""A robot behind a radio on a serial port, in a mission without a simulated world, as the guide shows it."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import pytest
from running_mission import mission_up
from serial_line import SerialLine, serial_line

from scout_model import radio_link

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

GUIDE = Path(__file__).parents[2] / "docs" / "how-to" / "use-real-devices.md"
DRIVE = '{"at_s":0.2,"left_rad_s":6,"right_rad_s":-6}\n{"at_s":0.8,"release":true}\n'
WITHIN_S = 30.0


def mission_of(guide: str, port: str) -> str:
    """Return a mission of the resources that the guide shows for a serial port."""
    shown = guide.partition("## A radio on a serial port")[2].partition("```xml\n")[2].partition("```")[0]
    assert shown.count("<resource ") == 2
    return f'<mission name="m" priority="1"><resources>{shown.replace("/dev/ttyUSB0", port)}</resources></mission>'


async def test_a_robot_is_driven_over_a_serial_port_and_gets_its_safe_packet_last(tmp_path: Path) -> None:
    with serial_line() as line, mission_up(mission_xml=written(tmp_path, line)) as mission:
        words = ("scout-console", "attach", "scout1", "--profile", "pendant", "--mission", mission.name)
        done = await asyncio.to_thread(mission.command, *words, "--script", "-", stdin=DRIVE)
        assert done.returncode == 0, f"{done.stdout}\n{done.stderr}\n{mission.story()}"
        assert [json.loads(one)["event"] for one in done.stdout.splitlines()][-1] == "released"
        frames = line.listen()
    assert {frame.network_id for frame in frames} == {1}
    packets = [radio_link.decode(frame.payload) for frame in frames]
    driven = [packet for packet in packets if isinstance(packet, radio_link.DrivePacket)]
    assert radio_link.DrivePacket(6.0, -6.0) in driven
    assert packets[-1] == radio_link.Safe()


async def test_a_mission_names_the_fault_of_a_radio_that_is_unplugged(tmp_path: Path) -> None:
    with serial_line() as line, mission_up(mission_xml=written(tmp_path, line)) as mission:
        line.unplug()
        await asyncio.to_thread(mission.wait_for_line, f"serial port {line.port} is gone", WITHIN_S)
        await asyncio.to_thread(mission.wait_for_line, f"serial port {line.port} cannot be opened", WITHIN_S)


def written(folder: Path, line: SerialLine) -> Path:
    file = folder / "serial.xml"
    file.write_text(mission_of(GUIDE.read_text(), line.port))
    return file
