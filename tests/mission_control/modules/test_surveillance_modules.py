"""The watching behavior's vision as modules says what its detector says, picture by picture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from backbone.debug_views import ViewKind
from mission_control.messages import GreyPicture, MotionSeen, Region, SwappedIn
from mission_control.modules.arrangement import GivenKey, UnitOrder, arranged
from mission_control.modules.graph import Graph, GraphRefused, Member
from mission_control.modules.module import Module
from mission_control.modules.orders import ModuleOrder, Source
from mission_control.modules.ports import type_name
from mission_control.modules.run import connected
from mission_control.modules.surveillance import Averaging, Detection, FrameDifference, Tracking
from mission_control.modules.units_together import UnitsTogether
from mission_control.vision.frame_averaging import FrameAveraging
from mission_control.vision.motion_detection import FAST_FRAMES, REJECTED_IN_TURN, MotionDetector

GIVEN = {"picture": type_name(GreyPicture), "swapped_in": type_name(SwappedIn)}
WIDTH_PX, HEIGHT_PX = 160, 120
scenes = st.lists(
    st.tuples(st.sampled_from(["still", "moving", "slipped", "lower", "swapped in"]), st.integers(1, 25)),
    min_size=2,
    max_size=8,
)


def picture_of(kind: str, number: int, rng: np.random.Generator) -> NDArray[np.uint8]:
    coarse = np.random.default_rng(1).integers(20, 220, (12, 16)).astype(np.uint8)
    room = cv2.resize(coarse, (WIDTH_PX, HEIGHT_PX), interpolation=cv2.INTER_NEAREST)
    picture = np.clip(room + rng.normal(0.0, 6.0, room.shape), 0, 255).astype(np.uint8)
    if kind == "moving":
        left = 6 * number % (WIDTH_PX - 40)
        picture[40:80, left : left + 40] = 250
    if kind == "slipped":
        picture = np.roll(picture, 40, axis=1)
    return picture[: HEIGHT_PX - 20] if kind == "lower" else picture


def message_of(pixels: NDArray[np.uint8], at_s: float) -> GreyPicture:
    height_px, width_px = pixels.shape
    return GreyPicture("scout1", at_s, width_px, height_px, memoryview(pixels.tobytes()))


def film(scene: Sequence[tuple[str, int]], modules: Sequence[Module]) -> tuple[list[Any], list[Any]]:
    """Show a scene to the detector and to the modules; return what each said."""
    detector, rng, at_s = MotionDetector(), np.random.default_rng(0), 0.0
    units, said, expected = connected(*modules, given=GIVEN), list[Any](), list[Any]()
    units.listen("motion", said.append)
    for kind, count in scene:
        if kind == "swapped in":
            detector.swapped_in()
            units.feed("swapped_in", SwappedIn(at_s), at_s)
        for number in range(count):
            pixels, at_s = picture_of(kind, number, rng), at_s + 1 / 15
            blob = detector.look(pixels)
            if blob is not None:
                region = Region(blob.x_px, blob.y_px, blob.width_px, blob.height_px)
                expected.append(MotionSeen(at_s, "scout1", region))
            units.feed("picture", message_of(pixels, at_s), at_s)
    return said, expected


@settings(max_examples=share(60))
@given(scenes)
def test_three_modules_say_what_the_detector_says(scene: list[tuple[str, int]]) -> None:
    said, expected = film(scene, [Tracking(), Detection(), Averaging()])
    assert said == expected


@pytest.mark.parametrize(
    "scene",
    [
        [("still", 20), ("moving", 20)],
        [("still", 20), ("slipped", REJECTED_IN_TURN + 30), ("moving", 30)],
        [("still", 12), ("moving", 10), ("swapped in", 1), ("moving", 30)],
        [("still", 12), ("moving", 10), ("lower", 12), ("moving", 40)],
    ],
)
def test_they_do_so_where_something_is_to_be_said(scene: list[tuple[str, int]]) -> None:
    said, expected = film(scene, [Averaging(), Detection(), Tracking()])
    assert said == expected
    assert len(said) > 3


def test_the_earlier_method_says_beside_them_what_it_says_by_itself() -> None:
    """RoboFrame 2006, section IV: different algorithms for one task are compared in the same application."""
    kinds: dict[str, Module] = {
        "averaging": Averaging(),
        "detection": Detection(),
        "tracking": Tracking(),
        "earlier": FrameDifference(FrameDifference.Parameters(averaged=2)),
    }
    members = [
        Member(name, one.ports(), outputs={"motion": "earlier-motion"} if name == "earlier" else {})
        for name, one in kinds.items()
    ]
    units = UnitsTogether(Graph({"one": members}, GIVEN), kinds)
    newer, earlier, alone, rng = list[Any](), list[Any](), FrameAveraging(2), np.random.default_rng(0)
    units.listen("motion", newer.append)
    units.listen("earlier-motion", earlier.append)
    expected = []
    for number in range(40):
        pixels = picture_of("moving" if number > 15 else "still", number, rng)
        blob = alone.look(pixels)
        if blob is not None:
            expected.append((float(number), blob.x_px, blob.y_px))
        units.feed("picture", message_of(pixels, float(number)), float(number))
    assert [(one.at_s, one.region.x_px, one.region.y_px) for one in earlier] == expected
    assert len(expected) > 3
    assert len(newer) > 3


def test_an_average_that_was_handed_over_does_not_change() -> None:
    averaging, rng = Averaging(), np.random.default_rng(0)
    units, seen = connected(averaging, Detection(), Tracking(), given=GIVEN), list[Any]()
    units.listen("comparison", lambda one: seen.append((one.average, one.average.copy())))
    for number in range(20):
        units.feed("picture", message_of(picture_of("moving", number, rng), 0.0), 0.0)
    assert len(seen) > 5
    assert all(np.array_equal(kept, copied) for kept, copied in seen)


@pytest.mark.parametrize("late", [2, FAST_FRAMES + 2])
def test_late_judgments_of_pictures_of_another_size_are_not_learned(late: int) -> None:
    """Units in other threads and processes judge a picture while the next ones are averaged."""
    averaging, detection, rng, judged = Averaging(), Detection(), np.random.default_rng(0), list[Any]()
    compared = 0
    for number in range(4 * FAST_FRAMES):
        picture = message_of(picture_of("still" if number < 2 * FAST_FRAMES else "lower", number, rng), number)
        newest = judged[-late] if len(judged) >= late else None
        comparison = averaging.update(Averaging.Inputs(picture=picture, judgment=newest)).comparison
        judged.append(judged[-1] if comparison is None and judged else None)
        if comparison is not None:
            compared += 1
            judged[-1] = detection.update(Detection.Inputs(comparison=comparison)).judgment
    assert compared == 2 * FAST_FRAMES


def test_detection_shows_what_it_goes_by_and_makes_nothing_unseen() -> None:
    shown: dict[str, ViewKind] = {}

    class Looking:
        def picture(self, view: str, make: Any) -> None:
            shown[view] = ViewKind.PICTURE
            assert make().ndim == 2

        def value(self, view: str, value: float | bool | str) -> None:
            shown[view] = ViewKind.VALUE

    detection = Detection()
    detection.debug = Looking()
    film([("still", 10)], [Averaging(), detection, Tracking()])
    assert shown == {"difference": ViewKind.PICTURE, "changed": ViewKind.PICTURE, "threshold": ViewKind.VALUE}


def test_the_three_are_one_unit_of_a_mission_and_large_pictures_stay_in_it() -> None:
    file = "mission_control.modules.surveillance"
    orders = [ModuleOrder(kind.lower(), f"{file}:{kind}") for kind in ("Averaging", "Detection", "Tracking")]
    given = {
        key: GivenKey(of, Source("ui_console/camera"))
        for key, of in (("picture", type_name(GreyPicture)), ("swapped_in", type_name(SwappedIn)))
    }
    whole = arranged([UnitOrder(name="vision", modules=orders)], given)["vision"]
    assert whole.published == ["judged", "motion"]
    apart = [UnitOrder(name=order.name, modules=[order]) for order in orders]
    with pytest.raises(GraphRefused, match=r"its class .*:BackgroundComparison is no message"):
        arranged(apart, given)
