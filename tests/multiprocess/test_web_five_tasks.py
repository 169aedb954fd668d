"""Five tasks of an operator at a tablet, by the guide alone: each touch finds its target by its words, and is counted.

The guide says how many touches each takes; a touch is a tap, a hold, or a drag of one finger. Choosing from a list
takes two.
"""

from __future__ import annotations

import re
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
import web_browser
from running_mission import mission_up
from served_page import Served, serving
from web_browser import Finger

pytestmark = [pytest.mark.processes, pytest.mark.timeout(300)]

GUIDE = Path(__file__).parents[2] / "docs/how-to/operate-from-a-browser.md"
APPLIED_OR_IGNORED = """() => {
  if (document.getElementById("applied").textContent.includes("move left +2.0")) return "applied";
  return document.getElementById("let-go").hidden ? "" : "ignored";
}"""
"""A page that heard nothing for most of a second ignores the finger, and asks to press anew."""


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with mission_up(name="iros2001") as mission, serving(mission) as made:
        yield made


def touches_of(task: str) -> int:
    """Return how many touches the guide says that a task takes."""
    found = re.search(rf"^\| {re.escape(task)} \| (\d+) \|", GUIDE.read_text(), re.MULTILINE)
    assert found is not None, f"the guide has no row for: {task}"
    return int(found[1])


class Person:
    """A person who reads and touches.

    Attributes:
        touches: How often the screen was touched.
    """

    def __init__(self, page: Any) -> None:
        self.page, self.touches = page, 0

    def card(self, robot: str) -> Any:
        return self.page.get_by_role("article", name=f"robot {robot}")

    async def tap(self, name: str, within: Any = None, role: str = "button") -> None:
        self.touches += 1
        await (within or self.page).get_by_role(role, name=name, exact=True).tap()

    async def hold(self, name: str) -> None:
        """Hold the button until it is gone, because what it does is done."""
        self.touches += 1
        button = self.page.get_by_role("button", name=name)
        await button.scroll_into_view_if_needed()
        box = await button.bounding_box()
        finger = Finger(self.page)
        await finger.put_down(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        await button.wait_for(state="hidden")
        await finger.lift()

    async def choose(self, label: str, option: str, within: Any) -> None:
        self.touches += 2
        await within.get_by_label(label).select_option(option)

    async def write(self, label: str, text: str, within: Any) -> None:
        self.touches += 1
        await within.get_by_label(label).fill(text)

    async def reads(self, words: str) -> None:
        await self.page.get_by_text(words).first.wait_for()


@asynccontextmanager
async def person(served: Served, size: str = "tablet") -> AsyncIterator[Person]:
    """Let a person come whose name is that of the device."""
    address = f"http://127.0.0.1:{served.port}/#token={served.token}"
    async with web_browser.page_at(size, address, shows=".robot[data-robot=scout1]") as page:
        yield Person(page)


async def drive(one: Person, robot: str) -> None:
    await one.tap(f"Take over {robot}", one.card(robot))
    await one.reads(f"you hold {robot}")
    one.touches += 1
    finger = Finger(one.page)
    while True:
        await finger.push_right()
        seen = await one.page.wait_for_function(APPLIED_OR_IGNORED)
        await finger.lift()
        if await seen.json_value() == "applied":
            return


async def test_drive_and_give_back(served: Served) -> None:
    async with person(served) as one:
        await drive(one, "scout1")
        await one.tap("Release")
        await one.reads("watching; you hold no robot")
        assert one.touches == touches_of("drive a robot and give it back")


async def test_stop_and_lift(served: Served) -> None:
    async with person(served) as one:
        await one.tap("Stop scout1")
        await one.reads("STOPPED by you")
        await one.hold("Hold to lift the stop of scout1 by you")
        await one.card("scout1").get_by_text("STOPPED").first.wait_for(state="hidden")
        assert one.touches == touches_of("stop a robot and lift the stop")


@pytest.mark.thorough
async def test_find_out_why_a_robot_waits(served: Served) -> None:
    async with person(served, "phone") as other, person(served) as one:
        await drive(other, "scout1")
        await one.tap("Why is scout1 as it is?")
        reading = one.page.get_by_role("dialog")
        await reading.get_by_text("phone").first.wait_for()
        await reading.get_by_text("waits for it").first.wait_for()
        assert one.touches == touches_of("find out why a robot waits")


@pytest.mark.thorough
async def test_see_who_moved_a_robot_at_a_given_time(served: Served) -> None:
    async with person(served, "phone") as other:
        await drive(other, "scout2")
        await other.tap("Release")
        await other.reads("watching; you hold no robot")
    async with person(served) as one:
        await one.tap("log", role="tab")
        form = one.page.get_by_role("search")
        await one.choose("Robot", "scout2", form)
        await one.write("Since", "5m", form)
        await one.write("Words", "driven", form)
        await one.tap("Search", form)
        await one.reads("is driven by phone")
        assert one.touches == touches_of("see who moved scout2 at a given time")


@pytest.mark.thorough
async def test_hand_a_robot_to_a_colleague(served: Served) -> None:
    async with person(served, "phone") as colleague, person(served) as one:
        await drive(one, "scout1")
        one.touches = 0
        await colleague.tap("Take over scout1", colleague.card("scout1"))
        await colleague.reads("waiting for scout1")
        await colleague.tap("May I?")
        await one.reads("phone asks for scout1")
        await one.tap("Let them have it")
        await colleague.reads("you hold scout1")
        assert one.touches == touches_of("hand a robot to a colleague who asks")
        assert colleague.touches == touches_of("ask a colleague for a robot")
