"""Names in a page's claims: long ones, and words that are no names."""

from __future__ import annotations

import pytest
from web_stage import LOW, Stage


async def test_a_claim_whose_arc_would_have_too_long_a_name_is_refused_and_the_others_drive_on(stage: Stage) -> None:
    stage.grant_all()
    async with stage.browser() as anna, stage.browser(LOW) as ben:
        await ben.say(do="take", robot="scout2")
        await ben.wait(lambda: ben.is_held, "held")
        await anna.say(do="take", robot="scout1")
        await anna.wait(lambda: anna.is_held, "held")
        await anna.say(do="take", robot="scout1", kind="k" * 60)
        await anna.wait(lambda: "is not a legal name" in anna.view["own"]["status"], "refused")
        assert ben.is_held
        await anna.say(do="take", robot="scout1", kind="capture")
        await anna.wait(lambda: anna.is_held, "held again")


@pytest.mark.parametrize("robot", ["?", "Scout 1", "a/b", "*", "s" * 64])
async def test_a_claim_of_a_robot_whose_name_cannot_be_one_ends_nothing(stage: Stage, robot: str) -> None:
    async with stage.browser() as anna, stage.browser(LOW) as ben:
        await anna.say(do="take", robot=robot)
        await ben.wait(lambda: ben.has_alarm("means nothing"), "alarm")
        await anna.say(do="why", name="scout1")
        await anna.wait(lambda: anna.answers, "its page goes on")
