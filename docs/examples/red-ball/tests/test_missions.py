"""The mission in this process on virtual time, and in processes of its own."""

import asyncio
from pathlib import Path

from backbone.keys import Conversation
from red_ball.messages import Ball

MISSION = Path(__file__).parents[1] / "mission.xml"
BALL = ("mission_control/vision/ball", Conversation.OUTPUTS, Ball)


def test_a_minute_of_the_mission(virtual_mission):
    balls = []

    async def minute(running):
        running.bus.subscribe(*BALL, lambda heard: balls.append(heard.body))
        await running.clock.sleep_s(60.0)
        return await running.statistics("vision")

    told = virtual_mission(MISSION, minute)
    assert told["ball-tracker_runs"] >= len(balls)
    assert abs(len(balls) - 60 * 20) <= 2


def test_the_mission_runs_in_real_processes(real_mission):
    async def three_balls(running):
        balls = asyncio.Queue()
        async with running.bus() as bus, asyncio.timeout(20):
            bus.subscribe(*BALL, lambda heard: balls.put_nowait(heard.body))
            return [await balls.get() for _ in range(3)]

    with real_mission(MISSION) as running:
        assert running.component("camera")["pid"] != running.component("vision")["pid"]
        assert len(asyncio.run(three_balls(running))) == 3
