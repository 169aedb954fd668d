"""The page with more robots than it shows pictures of at a time."""

from __future__ import annotations

import pytest
from web_page import card, page_at, take, wait_until
from web_stage import Stage

from ui_console.web.protocol import MOST_WATCHED

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]


async def test_the_large_robot_has_a_picture_however_many_robots_there_are(stage: Stage) -> None:
    """The one in hand, and one that is only looked at."""
    names = [f"scout{number}" for number in range(1, 31)]
    stage.place_robots(*names)
    async with page_at(stage) as page:
        [anna] = stage.hub.clients

        def is_watched(robot: str) -> bool:
            return robot in anna.outbox.watched and len(anna.outbox.watched) == MOST_WATCHED

        await card(page, names[-2]).get_by_role("button", name="large").click()
        await wait_until(lambda: is_watched(names[-2]), "its picture is asked for")
        await take(page, names[-1])
        await wait_until(lambda: is_watched(names[-1]), "its picture is asked for")
