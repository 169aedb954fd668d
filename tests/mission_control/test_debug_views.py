"""Debug views: made only while somebody looks, at most ten a second, and seen over the bus."""

from __future__ import annotations

import itertools
import re
import subprocess
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from fake_resource_pool import FakePlacer
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus
from backbone.debug_views import (
    LOOK_FOR_S,
    MOST_VIEWS,
    SHOWN_EVERY_S,
    ListViews,
    LookAt,
    LookedAt,
    UnknownView,
    ViewEntry,
    ViewKind,
    ViewPicture,
    Views,
    ViewValue,
    view_address,
)
from backbone.keys import Conversation
from backbone.mission.behavior_orders import behavior_order
from backbone.naming import IllegalName
from mission_control.behavior import Behavior
from mission_control.debug_views import DebugViews, LookBook, picture_of, sendable
from resource_pool.arc_client import Frame

BEHAVIOR = "mission_control/watch1"
GREY = np.zeros((2, 3), np.uint8)
steps = st.lists(
    st.tuples(st.sampled_from(["look", "show"]), st.sampled_from("ab"), st.floats(0.0, 0.4), st.floats(0.01, 1.0)),
    max_size=40,
)


@given(steps)
def test_a_view_is_shown_only_under_a_lease_and_never_twice_in_a_tenth_of_a_second(
    moments: list[tuple[str, str, float, float]],
) -> None:
    book, now_s = LookBook(SHOWN_EVERY_S), 0.0
    until_s: dict[str, float] = {}
    shown_s: dict[str, float] = {}
    for what, view, wait_s, for_s in moments:
        now_s += wait_s
        if what == "look":
            until_s[view] = max(until_s.get(view, 0.0), now_s + for_s)
            assert book.look(view, now_s + for_s) == until_s[view]
            continue
        is_looked_at = now_s < until_s.get(view, -1.0)
        has_rested = view not in shown_s or now_s >= shown_s[view] + SHOWN_EVERY_S
        assert book.take(view, now_s) == (is_looked_at and has_rested)
        if is_looked_at and has_rested:
            shown_s[view] = now_s
        if not is_looked_at:
            until_s.pop(view, None)
        if not until_s:
            assert book.is_empty


@given(
    arrays(
        st.sampled_from([np.uint8, np.float32, np.float64, np.int64, np.bool_]), array_shapes(min_dims=2, max_dims=2)
    )
)
def test_a_picture_of_any_numbers_becomes_grey_levels_of_the_same_size(made: Any) -> None:
    shown = picture_of("p", 1.0, made)
    assert (shown.height_px, shown.width_px, shown.is_color) == (*made.shape, False)
    levels = np.frombuffer(shown.pixels, np.uint8).reshape(made.shape)
    numbers = made if made.dtype == np.bool_ else np.nan_to_num(np.clip(made, 0, 255))
    expected = (numbers * 255 if made.dtype == np.bool_ else numbers).astype(np.uint8)
    assert (levels == expected).all()


def test_a_picture_is_a_copy_that_later_changes_do_not_reach() -> None:
    picture = GREY.copy()
    shown = picture_of("p", 1.0, picture)
    picture[:] = 9
    assert bytes(shown.pixels) == bytes(6)
    assert len(picture_of("p", 1.0, np.zeros((4, 5, 3))).pixels) == 60


@pytest.mark.parametrize("shape", [(3,), (2, 2, 4), (1, 8193), (4000, 2001), (2, 2, 2, 2)])
def test_a_picture_of_another_shape_or_too_large_is_a_mistake_of_the_behavior(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="the picture 'p' has shape"):
        picture_of("p", 1.0, np.zeros(shape, np.uint8))


ANY_TEXT = st.text(st.characters(exclude_categories=[]), max_size=9000)  # with lone surrogates, as of a file name
OF_OTHER_TYPES = st.sampled_from([None, [1, 2], 10**400, np.float32(1.5), np.array([1, 2]), np.array(["a"]), GREY])


@given(st.floats() | st.integers() | st.booleans() | ANY_TEXT | OF_OTHER_TYPES)
def test_every_value_fits_a_message(value: Any) -> None:
    """Otherwise it would end its behavior or unit when a person looks, and not before."""
    sent = msgspec.msgpack.encode(ViewValue("v", 1.0, sendable(value)))
    assert msgspec.msgpack.decode(sent, type=ViewValue).value == sendable(value)


async def alone(network: Any) -> tuple[DebugViews, Bus, VirtualClock]:
    clock = VirtualClock()
    bus = network.join(BEHAVIOR, clock)
    return DebugViews(bus, clock), bus, clock


def test_without_a_looker_nothing_is_made_and_nothing_goes_over_the_bus(local_mission: Any) -> None:
    def never() -> Any:
        raise AssertionError("nobody looks at this view")

    async def scene() -> None:
        async with local_mission("iros2001") as network:
            views, bus, clock = await alone(network)
            before = bus.statistics()
            for _ in range(100):
                views.picture("never", never)
                views.value("threshold", 12.5)
                await clock.sleep_s(0.07)
            assert bus.statistics() == before
            views.picture("other", lambda: GREY)
            views.look(LookAt("other", 1.0))
            views.picture("never", never)
            views.value("threshold", 13.0)
            assert bus.statistics() == before
            views.picture("other", lambda: GREY)
            assert bus.statistics().published == before.published + 1
            await bus.close()

    run_virtual(scene())


def test_names_are_legal_few_and_of_one_kind(local_mission: Any) -> None:
    async def scene() -> None:
        async with local_mission("iros2001") as network:
            views, bus, _clock = await alone(network)
            with pytest.raises(IllegalName):
                views.value("No Name", 1.0)
            views.value("v", 1.0)
            with pytest.raises(ValueError, match="'v' shows a value, not a picture"):
                views.picture("v", lambda: GREY)
            for number in range(MOST_VIEWS - 1):
                views.value(f"v{number}", 1.0)
            with pytest.raises(ValueError, match="one too many"):
                views.value("last", 1.0)
            assert len(views.listed().views) == MOST_VIEWS
            await bus.close()

    run_virtual(scene())


class Watcher(Behavior[Any]):
    """Shows each picture's first level, and the picture."""

    def see(self, frame: Frame) -> None:
        pixels = np.frombuffer(frame.pixels, np.uint8).reshape(frame.height_px, frame.width_px)
        self.views.picture("picture", lambda: pixels)
        self.views.value("level", int(pixels[0, 0]))


@asynccontextmanager
async def watching(local_mission: Any, kind: type[Behavior[Any]]) -> AsyncIterator[tuple[FakePlacer, Bus]]:
    async with local_mission("iros2001") as network:
        placer = FakePlacer(network, VirtualClock(), {"watcher": kind})
        try:
            arc = {"kind": "capture", "minimum_runtime_s": 5.0, "wish": {"scout": "scout1"}}
            given = {"type": "watcher", "name": "watch1", "priority": 3, "arc": arc}
            await placer.launch(behavior_order(given, [("iros2001", 10)]))
            await placer.wait(lambda: placer.arcs)
            await placer.arcs["watch1-capture"].grant()
            looker = network.join("ui_console/looker", placer.clock)
            yield placer, looker
            await looker.close()
        finally:
            await placer.close()


async def film(placer: FakePlacer, seconds: float) -> None:
    """Publish thirty pictures a second, each of its own level."""
    for number in range(round(30 * seconds)):
        placer.arcs["watch1-capture"].publish(bytes([number % 256] * 4), 2, 2, number)
        await placer.clock.sleep_s(1 / 30)


def scene_of(
    play: Callable[[FakePlacer, Bus], Awaitable[None]], local_mission: Any, kind: type[Behavior[Any]] = Watcher
) -> None:
    async def scene() -> None:
        async with watching(local_mission, kind) as (placer, looker):
            await play(placer, looker)

    run_virtual(scene())


def test_a_looker_sees_ten_pictures_a_second_until_its_lease_is_over(local_mission: Any) -> None:
    async def play(placer: FakePlacer, looker: Bus) -> None:
        heard: list[ViewPicture | ViewValue] = []
        for view in ("picture", "level"):
            looker.subscribe(
                view_address(BEHAVIOR, view),
                Conversation.VIEWS,
                ViewPicture | ViewValue,
                lambda envelope: heard.append(envelope.body),  # type: ignore[arg-type]
            )
        await film(placer, 1.0)
        assert heard == []
        looked = await looker.ask(BEHAVIOR, LookAt("picture", LOOK_FOR_S), LookedAt, within_s=1.0)
        assert looked == LookedAt("picture", ViewKind.PICTURE, placer.clock.now_s() + LOOK_FOR_S)
        await film(placer, 2 * LOOK_FOR_S)
        assert {shown.view for shown in heard} == {"picture"}
        assert 6 * LOOK_FOR_S <= len(heard) <= 10 * LOOK_FOR_S
        assert all(shown.at_s < looked.until_s for shown in heard)
        moments = [shown.at_s for shown in heard]
        assert all(after - before >= SHOWN_EVERY_S - 1e-9 for before, after in itertools.pairwise(moments))
        heard.clear()
        await looker.ask(BEHAVIOR, LookAt("level"), LookedAt, within_s=1.0)
        await placer.clock.sleep_s(0.01)
        [first] = heard  # the newest at once, although the behavior has seen nothing since
        assert isinstance(first, ViewValue)
        assert first.value == (round(30 * 2 * LOOK_FOR_S) - 1) % 256

    scene_of(play, local_mission)


def test_the_views_are_listed_with_their_newest_values_and_a_wrong_name_is_refused(local_mission: Any) -> None:
    async def play(placer: FakePlacer, looker: Bus) -> None:
        assert (await looker.ask(BEHAVIOR, ListViews(), Views, within_s=1.0)).views == []
        with pytest.raises(UnknownView, match="there is: none yet"):
            await looker.ask(BEHAVIOR, LookAt("level"), LookedAt, within_s=1.0)
        await film(placer, 0.2)
        listed = await looker.ask(BEHAVIOR, ListViews(), Views, within_s=1.0)
        assert listed.views == [
            ViewEntry("level", ViewKind.VALUE, 5.0),
            ViewEntry("picture", ViewKind.PICTURE),
        ]
        with pytest.raises(UnknownView, match=r"no view 'pictur' \(did you mean 'picture'\?\); there is: level"):
            await looker.ask(BEHAVIOR, LookAt("pictur"), LookedAt, within_s=1.0)

    scene_of(play, local_mission)


def test_the_behavior_of_the_guide_shows_what_the_guide_says(local_mission: Any) -> None:
    guide = Path(__file__).parents[2] / "docs/how-to/look-into-a-behavior.md"
    [code] = re.findall(r"```python\n(.*?)```", guide.read_text(), re.S)
    written: dict[str, Any] = {}
    exec(code, written)  # noqa: S102  the guide is ours

    async def play(placer: FakePlacer, looker: Bus) -> None:
        listed = await looker.ask(BEHAVIOR, ListViews(), Views, within_s=1.0)
        assert listed.views == []
        await film(placer, 0.2)
        listed = await looker.ask(BEHAVIOR, ListViews(), Views, within_s=1.0)
        assert [(entry.view, entry.kind) for entry in listed.views] == [
            ("brightness", ViewKind.VALUE),
            ("edges", ViewKind.PICTURE),
        ]
        heard: list[ViewPicture] = []
        at = view_address(BEHAVIOR, "edges")
        looker.subscribe(at, Conversation.VIEWS, ViewPicture, lambda envelope: heard.append(envelope.body))
        await looker.ask(BEHAVIOR, LookAt("edges"), LookedAt, within_s=1.0)
        await film(placer, 0.5)
        assert {(shown.width_px, shown.height_px) for shown in heard} == {(1, 2)}

    scene_of(play, local_mission, written["Edges"])


@pytest.mark.processes
def test_a_behavior_that_shows_nothing_does_not_load_numpy() -> None:
    code = "import sys, mission_control.behaviors.patrol; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
