"""People who open the same address without a name: each page is a person of its own."""

from __future__ import annotations

from web_stage import ANYBODY, Stage


async def test_the_stop_of_one_nameless_person_is_lifted_by_another_only_with_consent(stage: Stage) -> None:
    stage.place_robots("scout1")
    robot = stage.robots["scout1"]
    async with stage.browser(ANYBODY, page="7f01") as one, stage.browser(ANYBODY, page="8e02") as other:
        await one.say(do="stop_robot", robot="scout1")
        await other.wait(lambda: other.view["robots"] and other.view["robots"][0]["stop"], "stopped")
        assert not other.view["robots"][0]["stop"]["is_mine"]
        await other.say(do="lift", robot="scout1", number=robot.latch.state.number)
        await one.wait(lambda: one.view["own"]["consent"], "asked")
        assert robot.is_stopped
        await one.decide(is_given=True)
        await other.wait(lambda: not other.view["robots"][0]["stop"], "lifted")
