"""Debug views at browsers: each is looked at once for all who look, and not at all when nobody does."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from shown_views import BEHAVIOR, shower_at
from web_stage import LOW, Browser, Stage

from ui_console.web.pictures import jpeg
from ui_console.web.sights import PageSight

ROWS = [
    {"view": "red", "is_picture": True, "text": ""},
    {"view": "threshold", "is_picture": False, "text": "28"},
    {"view": "white", "is_picture": True, "text": ""},
]


def has_seen(browser: Browser, view: str, count: int = 3) -> bool:
    return len(browser.pictures.get(f"{BEHAVIOR}/{view}", [])) >= count


async def test_two_browsers_that_look_at_one_view_cost_one_look_and_the_end_of_both_ends_it(stage: Stage) -> None:
    shower = await shower_at(stage.placer)
    async with stage.browser() as anna:
        assert anna.view["seen"] == {"behavior": "", "views": [], "trouble": ""}
        async with stage.browser(LOW) as ben:
            for one in (anna, ben):
                await one.say(do="look", behavior=BEHAVIOR)
                await one.wait(lambda one=one: one.view["seen"]["views"] == ROWS, "the list")
                await one.say(do="look", behavior=BEHAVIOR, view="red")
            await anna.wait(lambda: has_seen(anna, "red"), "pictures")
            await ben.wait(lambda: has_seen(ben, "red"), "pictures")
            assert stage.hub.sights.looked_at == {PageSight(BEHAVIOR), PageSight(BEHAVIOR, "red")}
            assert set(shower.made) == {"red"}
            assert abs(shower.made["red"] - max(anna.pictures[f"{BEHAVIOR}/red"])) <= 1, "looked at once"
        await stage.placer.wait(lambda: len(stage.hub.clients) == 1)
        await anna.say(do="look", behavior=BEHAVIOR, view="white")
        await anna.wait(lambda: has_seen(anna, "white"), "the other view")
        assert stage.hub.sights.looked_at == {PageSight(BEHAVIOR), PageSight(BEHAVIOR, "white")}
        assert all(numbers == sorted(set(numbers)) for numbers in anna.pictures.values())
        assert anna.view["drawn"] == {}, "latencies are those of robots"
        await anna.say(do="look")
        await stage.placer.wait(lambda: not stage.hub.sights.looked_at)
        await anna.wait(lambda: anna.view["seen"]["behavior"] == "", "nothing")


@pytest.mark.parametrize("name", ["nobody", "No Name", "../x"])
async def test_a_behavior_that_is_not_there_is_told_in_the_list(stage: Stage, name: str) -> None:
    async with stage.browser() as anna:
        await anna.say(do="look", behavior=name, view="red")
        await anna.wait(lambda: anna.view["seen"]["trouble"] != "", "trouble")
        assert anna.view["seen"]["behavior"] == name
        assert not any(name in subject for subject in anna.pictures)


async def test_a_behavior_that_comes_back_is_seen_again(stage: Stage) -> None:
    await shower_at(stage.placer)
    async with stage.browser() as anna:
        await anna.say(do="look", behavior=BEHAVIOR, view="red")
        await anna.wait(lambda: has_seen(anna, "red"), "pictures")
        await stage.placer.kill(BEHAVIOR)
        await anna.wait(lambda: anna.view["seen"]["trouble"] != "", "trouble")
        anna.pictures.clear()
        await stage.placer.restart(BEHAVIOR)
        await anna.wait(lambda: has_seen(anna, "red"), "pictures again")
        await anna.wait(lambda: anna.view["seen"]["views"] == ROWS, "the list again")


def test_colors_arrive_as_they_were_sent() -> None:
    picture = np.zeros((8, 8, 3), np.uint8)
    picture[2:6, 3] = (0, 255, 0)
    unpacked = cv2.imdecode(np.frombuffer(jpeg(picture), np.uint8), cv2.IMREAD_COLOR)
    blue, green, red = unpacked[4, 3].tolist()
    assert green > 150
    assert max(blue, red) < 100
