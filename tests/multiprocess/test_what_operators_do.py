"""Every action of an operator on a running mission is published once, with the user's name."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from running_mission import RunningMission, mission_up

from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed, OperatorAction, login_name
from backbone.wire import Envelope

pytestmark = [pytest.mark.processes, pytest.mark.timeout(300)]

WITHIN_S = 10.0


@pytest.fixture
def mission() -> Iterator[RunningMission]:
    with mission_up() as running:
        yield running


class Record:
    """What a recorder hears of operators after the start, which it may still hear on a busy machine."""

    def __init__(self) -> None:
        self.acts: list[OperatorActed] = []
        self._news = asyncio.Event()

    def heard(self, envelope: Envelope[Any]) -> None:
        if envelope.body.action is not OperatorAction.START_MISSION:
            self.acts.append(envelope.body)
            self._news.set()

    async def until(self, condition: Callable[[], bool]) -> None:
        async with asyncio.timeout(WITHIN_S):
            while not condition():
                self._news.clear()
                await self._news.wait()

    def actions(self) -> list[OperatorAction]:
        return [act.action for act in self.acts]


@pytest.mark.thorough
async def test_each_command_that_changes_a_mission_is_one_event_with_its_user(mission: RunningMission) -> None:
    async with mission.bus("ui_console/recorder") as bus:
        record = Record()
        bus.subscribe("*/*", Conversation.OPERATORS, OperatorActed, record.heard)
        for words in (
            ("set", "watch-scout1", "priority", "7"),
            ("start", "video_frequency", "--name", "video9"),
            ("stop", "watch-scout2"),
            ("status",),
            ("why", "watch-scout1"),
        ):
            done = await asyncio.to_thread(mission.command, "scout-backbone", *words, "--mission", mission.name)
            assert done.returncode == 0, done.stderr
        await record.until(lambda: OperatorAction.STOP_COMPONENT in record.actions())
        ending = asyncio.create_task(asyncio.to_thread(mission.down))
        await record.until(lambda: OperatorAction.STOP_MISSION in record.actions())
    await ending
    assert {act.user for act in record.acts} == {login_name()}
    assert [(act.action, act.subject) for act in record.acts] == [
        (OperatorAction.SET_PARAMETER, "watch-scout1"),
        (OperatorAction.START_COMPONENT, "video9"),
        (OperatorAction.STOP_COMPONENT, "watch-scout2"),
        (OperatorAction.STOP_MISSION, mission.name),
    ]
    assert any(f"{mission.name}: {login_name()} started it" in line for line in mission.lines), mission.lines
