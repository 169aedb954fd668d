"""Actions of a person that follow each other faster than the mission carries them out: the last one counts."""

from __future__ import annotations

from web_stage import WITHIN_S, Stage

from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed, OperatorAction
from backbone.wire import Envelope

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


def actions(stage: Stage) -> list[str]:
    """Return the claims and releases from now on, as they become known."""
    heard: list[str] = []

    def hear(envelope: Envelope[OperatorActed]) -> None:
        acted = envelope.body
        if acted.action in (OperatorAction.TAKE, OperatorAction.RELEASE):
            heard.append(f"{acted.action} {acted.subject}")

    stage.rc_manager.subscribe("*/*", Conversation.OPERATORS, OperatorActed, hear)
    return heard


async def test_a_release_counts_although_an_equal_earlier_one_is_still_at_work(stage: Stage) -> None:
    stage.grant_all()
    async with stage.browser() as anna:
        await anna.say(**take("scout1"))
        await anna.wait(lambda: anna.is_held, "held")
        heard = actions(stage)
        for action in (RELEASE, take("scout2"), RELEASE):
            await anna.say(**action)
        await stage.placer.wait(lambda: heard == ["release scout1", "take scout2", "release scout2"], WITHIN_S)


async def test_a_robot_is_taken_although_an_equal_earlier_action_is_still_at_work(stage: Stage) -> None:
    stage.grant_all()
    async with stage.browser() as anna:
        await anna.say(**take("scout1"))
        await anna.wait(lambda: anna.is_held, "held")
        heard = actions(stage)
        for robot in ("scout2", "scout3", "scout2"):
            await anna.say(**take(robot))
        await stage.placer.wait(lambda: heard[-1:] == ["take scout2"] and "take scout3" in heard, WITHIN_S)
        await anna.wait(lambda: anna.is_held and anna.view["own"]["robot"] == "scout2", "held")
