"""Messages on the bus at browsers: overheard once for all who look, bounded, and not at all when nobody looks."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from bus_speaker import LOGGED, PICTURES, SPEAKER, event, speaker
from web_stage import LOW, Browser, Stage

from backbone.keys import COPIED, Conversation
from backbone.quality import NEVER_DROPPED
from backbone.recording.hearing import to_overhear
from ui_console.web.key_sight import KeySight, NoSuchKey, where_heard
from ui_console.web.protocol import ListKeys, ViewKey


def row_of(browser: Browser, key: str) -> dict[str, Any] | None:
    """Return this row of the list that came last."""
    lists = browser.told.get("/keys")
    return next((row for row in lists[-1]["rows"] if row["key"] == key), None) if lists else None


def rounds(browser: Browser, number: int) -> list[int]:
    """Return the numbers in the messages of a view."""
    fields = [{row["name"]: row["text"] for row in one["rows"]} for one in browser.told.get(f"/fields/{number}", [])]
    return [int(one["what"].removeprefix("round ")) for one in fields]


def is_reported(browser: Browser) -> bool:
    """Return whether the server shows a violation."""
    return any(alarm["kind"] == "visitor" for alarm in browser.view["alarms"])


async def wait_nothing_heard(stage: Stage) -> None:
    await stage.placer.wait(lambda: not stage.network.overhearers)
    assert (stage.hub.keys.is_counting, stage.hub.keys.looked_at) == (False, frozenset())


async def test_keys_are_counted_only_while_a_page_has_the_list_open(stage: Stage) -> None:
    async with speaker(stage), stage.browser() as anna, stage.browser(LOW) as ben:
        assert stage.network.overhearers == []
        for one in (anna, ben):
            await one.say(do="list_keys", is_open=True)
            await one.wait(lambda one=one: row_of(one, LOGGED["key"]), "the list")
        assert len(stage.network.overhearers) == len(to_overhear(()))
        await anna.wait(lambda: (row_of(anna, LOGGED["key"]) or {})["messages_per_s"] > 10.0, "a rate")
        row = row_of(anna, LOGGED["key"])
        assert row is not None
        assert (row["source"], row["schema"], row["mean_bytes"] > 40) == (SPEAKER, "StoryEvent/1", True)
        await anna.say(do="list_keys", is_open=True, words="CAPTURE frame", order="bytes")
        await anna.wait(lambda: anna.told["/keys"][-1]["matching"] == 1, "the words")
        assert row_of(anna, PICTURES["key"]) is not None
        await anna.say(do="list_keys", is_open=False)
        await ben.say(do="list_keys", is_open=False)
        await wait_nothing_heard(stage)
        ben.told.clear()
        await ben.say(do="list_keys", is_open=True)
        await ben.wait(lambda: "/keys" in ben.told, "the list again")
        assert LOGGED["key"] in {row["key"] for row in ben.told["/keys"][0]["rows"]}, "known from before"


async def test_two_pages_that_view_a_key_cost_one_subscription_and_the_last_to_go_ends_it(stage: Stage) -> None:
    async with speaker(stage), stage.browser() as anna:
        async with stage.browser(LOW) as ben:
            await anna.say(do="view_key", number=1, **LOGGED)
            await anna.wait(lambda: len(rounds(anna, 1)) >= 3, "messages")
            await ben.say(do="view_key", number=8, **LOGGED)
            await ben.wait(lambda: len(rounds(ben, 8)) >= 3, "messages")
            assert len(stage.network.overhearers) == 1
        await stage.placer.wait(lambda: len(stage.hub.clients) == 1)
        assert stage.hub.keys.looked_at == {tuple(LOGGED.values())}
        shown = anna.told["/fields/1"][-1]
        assert {"subject", "at_s"} <= {row["name"] for row in shown["rows"]}
        assert next(row["number"] for row in shown["rows"] if row["name"] == "at_s") > 0.0
        assert not any(name.startswith("/picture") for name in anna.pictures)
        await anna.say(do="view_key", number=2, **PICTURES)
        await anna.wait(lambda: len(anna.pictures.get("/picture/2", [])) >= 3, "pictures")
        assert anna.view["drawn"] == {}, "latencies are those of robots"
    await wait_nothing_heard(stage)


async def test_a_page_gets_the_newest_and_at_most_some_ten_a_second(stage: Stage) -> None:
    async with speaker(stage), stage.browser() as anna:
        await anna.say(do="view_key", number=1, **LOGGED)
        await anna.wait(lambda: len(rounds(anna, 1)) >= 10, "messages")
        seen = rounds(anna, 1)
        assert seen == sorted(set(seen))
        assert seen[9] - seen[0] >= 30, "some of ninety between"


async def test_a_page_that_draws_nothing_is_sent_little(stage: Stage) -> None:
    async with speaker(stage), stage.browser() as anna:
        idle = anna.say

        async def says_no_drawn(**message: Any) -> None:
            if message["do"] != "drawn":
                await idle(**message)

        anna.say = says_no_drawn  # type: ignore[method-assign]
        await anna.say(do="view_key", number=1, **LOGGED)
        await anna.wait(lambda: len(rounds(anna, 1)) == 2, "messages")
        await asyncio.sleep(0.5)
        assert len(rounds(anna, 1)) == 2


async def test_a_page_that_comes_later_has_the_last_message_of_a_silent_key_too(stage: Stage) -> None:
    bus = stage.network.join(SPEAKER, stage.clock)
    async with stage.browser() as anna, stage.browser(LOW) as ben:
        await anna.say(do="view_key", number=1, **LOGGED)
        await stage.placer.wait(lambda: len(stage.network.overhearers) == 1)
        bus.publish(SPEAKER, Conversation.LOG, event(stage, 7))
        await anna.wait(lambda: rounds(anna, 1) == [7], "the message")
        await ben.say(do="view_key", number=1, **LOGGED)
        await ben.wait(lambda: rounds(ben, 1) == [7], "the same")
        await anna.say(do="view_key", number=2, **LOGGED)
        await anna.wait(lambda: rounds(anna, 2) == [7], "again")
    await bus.close()


@pytest.mark.parametrize("key", ["resource_pool/scout1/alive", "resource_pool/scout1/told", "a/b/nonsense", "x/log"])
async def test_a_key_at_which_nothing_is_sent_is_refused(stage: Stage, key: str) -> None:
    async with stage.browser() as anna:
        await anna.say(do="view_key", number=1, key=key)
        await anna.wait(lambda: anna.answers, "an answer")
        assert anna.answers[0]["refused"].startswith(f"no message is sent at {key}")
        assert stage.network.overhearers == []


@pytest.mark.parametrize(
    "hostile",
    [
        {"do": "view_key", "number": 1, "key": "*/*/log"},
        {"do": "view_key", "number": 1, "key": "resource_pool/**/log"},
        {"do": "view_key", "number": 1, "key": "resource_pool/scout1/log", "source": "*/x"},
        {"do": "view_key", "number": -1},
        {"do": "view_key", "number": 1, "key": "a/" * 200 + "log"},
        {"do": "list_keys", "is_open": True, "words": "(a+)+" * 20},
        {"do": "list_keys", "is_open": True, "order": "random"},
    ],
)
async def test_what_no_page_says_is_a_violation(stage: Stage, hostile: dict[str, Any]) -> None:
    async with stage.browser() as anna:
        await anna.say(**hostile)
        await anna.wait(lambda: is_reported(anna), "an alarm")
        assert stage.network.overhearers == []


@pytest.mark.thorough
async def test_thousands_of_views_of_keys_that_nobody_speaks_at_leave_one_and_then_none(stage: Stage) -> None:
    async with stage.browser() as anna:
        for number in range(1000):
            await anna.say(do="view_key", number=number, key=f"resource_pool/no{number}/log", schema=f"No{number}/1")
            if number % 50 == 0:
                await asyncio.sleep(0.3)  # not so fast that the server cuts the page off
                assert len(stage.network.overhearers) <= 1
        await stage.placer.wait(lambda: stage.hub.keys.looked_at == {("resource_pool/no999/log", "", "No999/1")})
        assert not is_reported(anna)
    await wait_nothing_heard(stage)


@pytest.mark.parametrize("conversation", sorted(set(Conversation) - {Conversation.ALIVE, *COPIED}))
def test_only_one_component_makes_copies_for_a_view(conversation: Conversation) -> None:
    heard, of = where_heard(f"resource_pool/scout1/{conversation}", "resource_pool/radio")
    assert heard in to_overhear((f"resource_pool/scout1/{conversation}",))
    is_copied_by_sender = conversation in NEVER_DROPPED
    assert of == ("resource_pool/radio" if is_copied_by_sender else "resource_pool/scout1")


def test_a_sight_that_is_refused_leaves_the_one_before() -> None:
    sight = KeySight().after(ListKeys(True, "a")).after(ViewKey(3, "resource_pool/scout1/log"))
    assert sight.streams == {"/keys", "/fields/3", "/picture/3"}
    with pytest.raises(NoSuchKey):
        sight.after(ViewKey(4, "resource_pool/scout1/lot"))
    assert sight.after(ListKeys(False)).after(ViewKey(5)).streams == frozenset()
