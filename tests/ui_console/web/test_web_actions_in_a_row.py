"""Actions of a person that follow each other faster than the mission carries them out: the last one counts."""

from __future__ import annotations

from web_stage import Stage

RELEASE = {"do": "release"}


def take(robot: str) -> dict[str, str]:
    return {"do": "take", "robot": robot}


def is_given_back(stage: Stage, times: int) -> bool:
    """Return whether so many ARCs were started, and each of them rests or has ended."""
    return len(stage.placer.started) == times and all(arc.is_idle for arc in stage.placer.arcs.values())


async def test_a_robot_that_is_wanted_while_the_console_of_a_page_begins_is_taken(stage: Stage) -> None:
    stage.grant_all()
    async with stage.browser() as anna:
        await anna.say(**take("scout1"))
        await anna.say(**take("scout2"))
        await anna.wait(lambda: anna.is_held and anna.view["own"]["robot"] == "scout2", "held")
        assert [arc.rcs["scout"] for arc in stage.placer.arcs.values()] == ["scout2"]


async def test_a_release_while_the_console_of_a_page_begins_leaves_no_robot_claimed(stage: Stage) -> None:
    stage.grant_all()
    async with stage.browser() as anna:
        await anna.say(**take("scout1"))
        await anna.say(**RELEASE)
        await stage.placer.wait(lambda: is_given_back(stage, 1))
