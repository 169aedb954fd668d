"""The papers' second kind of ARC: a person drives a robot and sees its video, without a framegrabber."""

from __future__ import annotations

from typing import Any

from pool_on_local_network import HERE, HandOperatedGrabber, a_pool

from backbone.bus.clock import run_virtual
from backbone.dependency_database.messages import Resource
from resource_pool.arc_client import Frame
from resource_pool.devices.monitor.arcs import MonitorDriveArc
from resource_pool.devices.monitor.rc import Monitor
from resource_pool.rcs.framegrabber import SILENT_S
from scout_model.radio_link import encode_safe, encode_transmitter_on

LINKS = {"video_frequency": ["video"]}
HARDWARE = [
    Resource("screen", "monitor", parameters={"camera": "paint"}, links=LINKS),
    Resource("bench_screen", "monitor", driver=f"{HERE}:HandOperatedGrabber", links=LINKS),
]
CLASSES: dict[str, Any] = {"rc_classes": {"monitor": Monitor}, "arc_classes": {"monitor_drive": MonitorDriveArc}}


def test_the_person_who_drives_sees_the_robots_picture_and_no_framegrabber_is_held(local_mission: Any) -> None:
    async def main() -> None:
        rcs = ["scout1", "radio", "video", "grabber", "screen"]
        async with a_pool(local_mission, rcs, hardware=HARDWARE, **CLASSES) as pool:
            _person, arc = await pool.console("anna", "monitor_drive", "scout1")
            seen: list[Frame] = []
            arc.frames(seen.append)
            granted = await arc.wait_granted()
            assert sorted(granted.rcs.values()) == ["radio", "scout1", "screen", "video"]
            for _ in range(20):
                await arc.move(0.2)
                await pool.clock.sleep_s(0.1)
            assert len(seen) > 20
            assert {(frame.rc, frame.robot) for frame in seen[5:]} == {("screen", "scout1")}
            assert bytes(seen[5].pixels) != bytes(seen[-1].pixels)
            await arc.idle()
            await pool.clock.sleep_s(0.5)
            assert pool.radio_driver.heard_by(1)[-1].payload == encode_safe()
            dark = len(seen)
            await pool.clock.sleep_s(1.0)
            assert len(seen) == dark

    run_virtual(main())


def test_it_shows_snow_and_interference_which_a_framegrabber_keeps_back(local_mission: Any) -> None:
    async def main() -> None:
        rcs = ["scout1", "radio", "video", "bench_screen"]
        async with a_pool(local_mission, rcs, hardware=HARDWARE, **CLASSES) as pool:
            _person, arc = await pool.console("anna", "monitor_drive", "scout1")
            seen: list[Frame] = []
            arc.frames(seen.append)
            await arc.wait_granted()
            screen = HandOperatedGrabber.built[-1]
            assert (screen.frequency, screen.deliver is not None) == ("video", True)
            for transmitters in (1, 0, 2):
                assert screen.deliver is not None
                screen.deliver(screen.picture(transmitters))
                await pool.clock.sleep_s(0.1)
            assert [frame.rc for frame in seen] == ["bench_screen"] * 3

    run_virtual(main())


def test_a_transmitter_that_fell_silent_is_switched_on_again(local_mission: Any) -> None:
    async def main() -> None:
        rcs = ["scout1", "radio", "video", "bench_screen"]
        async with a_pool(local_mission, rcs, hardware=HARDWARE, **CLASSES) as pool:
            _person, arc = await pool.console("anna", "monitor_drive", "scout1")
            await arc.wait_granted()
            screen = HandOperatedGrabber.built[-1]
            for _ in range(round(SILENT_S / 0.1) + 3):
                assert screen.deliver is not None
                screen.deliver(screen.picture(0))
                await pool.clock.sleep_s(0.1)
            switched = [packet.payload for packet in pool.radio_driver.heard_by(1)]
            assert switched.count(encode_transmitter_on("video")) == 2

    run_virtual(main())
