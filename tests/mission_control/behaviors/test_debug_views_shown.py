"""Each behavior that sees shows the views that the reference names, and each can be looked at."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fake_resource_pool import FakePlacer

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.debug_views import (
    ListViews,
    LookAt,
    LookedAt,
    ViewKind,
    ViewPicture,
    Views,
    ViewValue,
    view_address,
)
from backbone.keys import Conversation
from backbone.mission.behavior_orders import behavior_order
from mission_control.behavior import Behavior
from mission_control.behaviors.hide import Hide
from mission_control.behaviors.servo_to_target import ServoToTarget
from mission_control.behaviors.watch_for_motion import WatchForMotion
from mission_control.vision.landmark import DISC_DIAMETER_M, PITCH_M

PAGE = Path(__file__).parents[3] / "docs/reference/behaviors.md"
WIDTH_PX, HEIGHT_PX, PITCH_PX = 320, 240, 24
SIZES = {"difference": (160, 120), "changed": (160, 120), "glimpse": (40, 15)}
IN_COLOR = {"blobs", "skeleton"}


def named(behavior: str) -> set[str]:
    """Return the views that the reference names for a behavior."""
    section = PAGE.read_text().partition("## Debug views")[2]
    found: dict[str, set[str]] = {}
    last = ""
    for who, views in re.findall(r"^\| ([^|]*)\| ([^|]*)\|", section, re.M):
        last = who.strip() or last
        found.setdefault(last, set()).update(re.findall(r"`(\w+)`", views))
    return next(views for who, views in found.items() if f"`{behavior}`" in who)


def landmark(number: int) -> bytes:
    """Return a picture of the landmark on a white wall, with a bright block that goes from left to right."""
    rows, columns = np.mgrid[:HEIGHT_PX, :WIDTH_PX]
    picture = np.full((HEIGHT_PX, WIDTH_PX), 180, np.uint8)
    for right, down in ((-1, 0), (0, 0), (1, 0), (0, 1)):
        away_px = np.hypot(columns - 160 - PITCH_PX * right, rows - 100 - PITCH_PX * down)
        picture[away_px < PITCH_PX * DISC_DIAMETER_M / PITCH_M / 2] = 20
    picture[180:230, 4 * number % 270 :][:, :50] = 90
    return picture.tobytes()


@pytest.mark.parametrize(
    ("name", "kind"), [("watch_for_motion", WatchForMotion), ("servo_to_target", ServoToTarget), ("hide", Hide)]
)
def test_a_behavior_shows_what_the_reference_names(local_mission: Any, name: str, kind: type[Behavior[Any]]) -> None:
    heard: dict[str, ViewPicture | ViewValue] = {}

    async def scene() -> None:
        async with local_mission("iros2001") as network:
            clock = VirtualClock()
            placer = FakePlacer(network, clock, {name: kind})
            looker = network.join("ui_console/looker", clock)
            arc = {"kind": "capture", "minimum_runtime_s": 5.0, "wish": {"scout": "scout1"}}
            order = {"type": name, "name": "seer", "priority": 3, "arc": arc}
            await placer.launch(behavior_order(order, [("iros2001", 10)]))
            await placer.wait(lambda: placer.arcs)
            [granted] = placer.arcs.values()
            await granted.grant()
            for number in range(40):
                granted.publish(landmark(number), WIDTH_PX, HEIGHT_PX, number)
                await clock.sleep_s(1 / 15)
                if number == 20:
                    await look_at_all(looker)
            await placer.close()
            await looker.close()

    async def look_at_all(looker: Any) -> None:
        listed = (await looker.ask("mission_control/seer", ListViews(), Views, within_s=1.0)).views
        for entry in listed:
            at = view_address("mission_control/seer", entry.view)
            looker.subscribe(at, Conversation.VIEWS, ViewPicture | ViewValue, note)
            looked = await looker.ask("mission_control/seer", LookAt(entry.view), LookedAt, within_s=1.0)
            assert looked.kind is entry.kind
        assert {entry.view for entry in listed if entry.kind is ViewKind.PICTURE} & (IN_COLOR | SIZES.keys())

    def note(envelope: Any) -> None:
        heard[envelope.body.view] = envelope.body

    run_virtual(scene())
    assert heard.keys() == named(name)
    for view, shown in heard.items():
        if isinstance(shown, ViewPicture):
            assert (shown.width_px, shown.height_px) == SIZES.get(view, (WIDTH_PX, HEIGHT_PX))
            assert shown.is_color is (view in IN_COLOR)
    if name == "servo_to_target":
        assert isinstance(phase := heard["phase"], ViewValue)
        assert phase.value == "tracking"
