"""A recording at a page: each time of it shows what was so then, however one got there; nothing can be commanded."""

from __future__ import annotations

import asyncio
import io
import json
from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from made_files.page_types import View
from msgspec import inspect
from sent_types import odd
from small_recordings import SCOUT, Said, recorded

from backbone.addresses import NAMESERVER, RC_MANAGER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.messages import AskState, ComponentState, LifeState, LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.recording.presence import Presence
from backbone.recording.reader import Recording
from backbone.scheduling.requests import Holder
from backbone.scheduling.views import RcView, Schedule
from backbone.wire import Message, schema_of
from resource_pool.arc_client import Frame
from ui_console.session.recorded_play import NOT_NOW
from ui_console.web import playing, protocol
from ui_console.web.hub import WebHub
from ui_console.web.login import Welcome
from ui_console.web.operator import Operator
from ui_console.web.recording_room import RecordingRoom, Viewer

ARC = "watch-capture"
FIRST_S, LAST_S = 1.0, 60.0
EACH_S = 5.0


def said_by(address: str, at_s: float, conversation: Conversation, body: Message) -> Said:
    return Said(at_s, address, conversation, body, address)


def state(address: str, kind: str, doing: str = "") -> ComponentState:
    return ComponentState(address, kind, "base", 7, LifeState.READY, 0.5, doing, is_robot=kind == "scout")


def a_minute() -> list[Said]:
    """Return a mission in which a robot says each five seconds how often it did, and an ARC holds it all the time."""
    begin = [Said(FIRST_S, at, Conversation.ALIVE, Presence(True), "") for at in (NAMESERVER, RC_MANAGER, SCOUT)] + [
        said_by(RC_MANAGER, 1.1, Conversation.STATUS, state(RC_MANAGER, "rc_manager"))
    ]
    told: list[Said] = []
    for number in range(12):
        at_s = 2.0 + EACH_S * number
        holder = Holder(ARC, number + 1, at_s, 0.0)
        views = [RcView("scout1", "scout", "up", False, 1.0, [holder], number + 1, [], [at_s + 9.0], is_robot=True)]
        told += [
            said_by(SCOUT, at_s, Conversation.STATUS, state(SCOUT, "scout", f"round {number}")),
            said_by(RC_MANAGER, at_s, Conversation.SCHEDULE, Schedule(at_s, views, [], [])),
            said_by(f"resource_pool/{ARC}", at_s, Conversation.FRAMES, picture(at_s, number)),
            said_by(
                SCOUT, at_s, Conversation.LOG, StoryEvent(at_s, SCOUT, f"round {number}", "scout1", "", LogLevel.INFO)
            ),
        ]
    fell = StoryEvent(LAST_S, SCOUT, "fell over", "scout1", "", LogLevel.ALARM)
    return [*begin, *told, said_by(SCOUT, LAST_S, Conversation.LOG, fell)]


def picture(at_s: float, number: int) -> Frame:
    return Frame("grabber", ARC, number + 1, "scout1", number, at_s, 4, 2, bytes([number * 10]) * 8)


FILE = recorded(a_minute()).getvalue()


class Page:
    """What a page would show."""

    def __init__(self, room: RecordingRoom) -> None:
        self.room = room
        self.viewer: Viewer = room.enter(Welcome("anna", 100))
        self.view: dict[str, Any] = {}
        self.answers: list[dict[str, Any]] = []
        self.pictures = 0
        self.told: dict[str, Any] = {}

    async def does(self, intent: Any) -> None:
        await self.room.obey(self.viewer, intent)

    async def looks(self, seconds: float = 2.5) -> dict[str, Any]:
        """Return the view after so long."""
        clock = VirtualClock()
        until_s = clock.now_s() + seconds
        while clock.now_s() < until_s:
            while (message := self.viewer.outbox.next(clock.now_s())) is not None:
                if isinstance(message, bytes):
                    stream = message[1 : 1 + message[0]].decode()
                    number = int.from_bytes(message[1 + message[0] : 5 + message[0]], "big")
                    await self.does(protocol.Drawn(stream, number))
                    if stream.startswith(("/keys", "/fields")):
                        self.told[stream] = json.loads(message[13 + message[0] :])
                    else:
                        self.pictures += 1
                    continue
                said = json.loads(message)
                self.view |= said.get("view", {})
                self.answers += [said["answer"]] if "answer" in said else []
            await clock.sleep_s(0.05)
        return self.view

    async def round(self) -> str:
        """Return what the robot says it does."""
        view = await self.looks()
        return str({one["address"]: one["feedback"] for one in view["components"]}.get(SCOUT, "gone"))


def on_a_page(scene: Callable[[RecordingRoom, Page], Awaitable[None]], file: bytes = FILE) -> None:
    async def run() -> None:
        room = RecordingRoom(lambda: io.BytesIO(file), VirtualClock())
        life = asyncio.create_task(room.run())
        try:
            await scene(room, Page(room))
        finally:
            room.end("the test is over")
            await life

    run_virtual(run())


def round_at(at_s: float) -> str:
    return f"round {int((at_s - 2.0) // EACH_S)}" if at_s >= 2.0 else "gone"


@settings(max_examples=share(25))
@given(times=st.lists(st.floats(2.0, LAST_S), min_size=1, max_size=4))
def test_a_time_shows_the_same_however_one_got_there(times: list[float]):
    async def scene(room: RecordingRoom, page: Page) -> None:
        for at_s in times:
            await page.does(playing.ShowTime(at_s))
            assert await page.round() == round_at(at_s)
            assert room.play.playback.now_s() == at_s
            assert page.view["playback"]["at_s"] == pytest.approx(at_s, abs=1e-3)

    on_a_page(scene)


def test_it_is_played_paused_and_stops_at_the_end():
    async def scene(room: RecordingRoom, page: Page) -> None:
        await page.looks()
        assert page.view["playback"] == {
            "begin_s": FIRST_S, "end_s": LAST_S, "at_s": FIRST_S, "is_playing": False, "speed": 1.0,
        }  # fmt: skip
        assert [one["line"] for one in page.view["markers"]] == ["scout1: fell over"]
        assert odd(page.view, inspect.type_info(View)) == ["view.beat"], "the page was not asked for a sign of life"
        await page.does(playing.PlayOn(2.0))
        await page.looks(10.0)
        await page.does(playing.StandStill())
        assert await page.round() == round_at(room.play.playback.now_s()) == "round 3"
        await page.does(playing.PlayOn(10.0))
        view = await page.looks(10.0)
        assert (view["playback"]["at_s"], view["playback"]["is_playing"]) == (LAST_S, False)
        await page.does(playing.PlayOn(10.0))
        assert room.play.playback.now_s() == FIRST_S, "from the begin again"

    on_a_page(scene)


def test_a_step_goes_to_the_next_picture_or_event():
    async def scene(room: RecordingRoom, page: Page) -> None:
        await page.does(playing.ShowTime(12.5))
        await page.looks()
        await page.does(playing.StepOn())
        assert room.play.playback.now_s() == 17.0
        assert await page.round() == "round 3"
        await page.does(playing.ShowTime(LAST_S))
        await page.looks()
        await page.does(playing.StepOn())
        assert room.play.playback.now_s() == LAST_S

    on_a_page(scene)


def test_pictures_come_also_where_time_stands_still():
    async def scene(_room: RecordingRoom, page: Page) -> None:
        await page.does(protocol.Watch(["scout1"]))
        await page.does(playing.ShowTime(33.0))
        await page.looks(4.0)
        assert page.pictures

    on_a_page(scene)


@pytest.mark.parametrize(
    "intent",
    [
        protocol.TakeOver("scout1"),
        protocol.StopRequest("scout1"),
        protocol.StopAllRequest(),
        protocol.Steer(0, 1.0, 0.0, 1.0),
        protocol.SetRequest("scout1", "speed", 1),
        protocol.EndOrders(["scout1"]),
    ],
)
def test_nothing_can_be_commanded(intent: protocol.Intent):
    async def scene(_room: RecordingRoom, page: Page) -> None:
        await page.does(intent)
        await page.looks()
        assert page.answers == [{"refused": NOT_NOW}]

    on_a_page(scene)


def test_what_was_said_is_listed_and_viewed_at_any_time():
    async def scene(_room: RecordingRoom, page: Page) -> None:
        await page.does(protocol.ListKeys(True, "status"))
        await page.does(protocol.ViewKey(1, f"{SCOUT}/status", SCOUT, schema_of(ComponentState)))
        for at_s in (33.0, 12.0):
            await page.does(playing.ShowTime(at_s))
            await page.looks()
            assert f"{SCOUT}/status" in {row["key"] for row in page.told["/keys"]["rows"]}
            fields = {row["name"]: row["text"] for row in page.told["/fields/1"]["rows"]}
            assert fields["feedback"] == round_at(at_s)

    on_a_page(scene)


def test_all_keys_of_the_recording_are_listed_and_viewed_also_those_that_say_nothing_now():
    """Red before: tokens and questions were not listed, nor what said nothing since the page looked."""
    anna = "ui_console/anna"
    file = recorded([*a_minute(), Said(LAST_S, SCOUT, Conversation.ASK, AskState(), anna)]).getvalue()
    held = Recording(io.BytesIO(file)).contents().counts
    rows = {(one.key.split("/", 2)[2], one.source, one.schema) for one in held}

    async def scene(_room: RecordingRoom, page: Page) -> None:
        await page.does(playing.ShowTime(38.0))
        await page.does(protocol.ListKeys(True))
        await page.looks()
        listed = page.told["/keys"]["rows"]
        assert {(row["key"], row["source"], row["schema"]) for row in listed} == rows
        rates = {row["key"]: row["messages_per_s"] for row in listed}
        assert [0.1 < rates[f"{SCOUT}/{one}"] < 0.5 for one in ("status", "log", "ask")] == [True, True, False]
        await page.does(protocol.ListKeys(False))
        for number, (key, source, schema) in enumerate(sorted(rows)):
            await page.does(protocol.ViewKey(number, key, source, schema))
            await page.looks(0.5)
            assert page.told.get(f"/fields/{number}", {}).get("rows") or key.endswith("/ask"), key
        await page.does(playing.ShowTime(LAST_S))
        await page.does(protocol.ViewKey(99, f"{SCOUT}/ask", anna, schema_of(AskState)))
        await page.looks()
        assert page.told["/fields/99"]["stamp_s"] == LAST_S
        assert not page.answers

    on_a_page(scene, file)


def test_what_was_so_can_be_asked():
    async def scene(_room: RecordingRoom, page: Page) -> None:
        await page.does(playing.ShowTime(20.0))
        await page.does(protocol.WhyRequest("scout1"))  # at once: the answer is of that time all the same
        await page.looks()
        assert any("round 3" in line for line in page.answers[0]["lines"]), page.answers

    on_a_page(scene)


def test_pages_see_the_same_time_and_one_may_leave():
    async def scene(room: RecordingRoom, page: Page) -> None:
        other = Page(room)
        await other.does(playing.ShowTime(47.0))
        await page.looks()
        await room.leave(other.viewer, "has gone away")
        await page.does(playing.ShowTime(7.0))
        assert await page.round() == "round 1"
        assert len(room.clients) == 1

    on_a_page(scene)


def test_a_page_may_leave_while_all_go_to_another_time(monkeypatch: pytest.MonkeyPatch):
    async def scene(room: RecordingRoom, page: Page) -> None:
        others, leave = [Page(room), Page(room)], WebHub.leave

        async def another_leaves(hub: WebHub, operator: Operator, reason: str) -> None:
            if others:
                await room.leave(others.pop().viewer, "has gone away")
            await leave(hub, operator, reason)

        monkeypatch.setattr(WebHub, "leave", another_leaves)
        await page.does(playing.ShowTime(47.0))
        assert await page.round() == "round 9"
        assert (len(room.clients), len(room.play.console.clients)) == (1, 1)

    on_a_page(scene)
