"""The page keeps the pad and its buttons in place while other elements come and go."""

from __future__ import annotations

from typing import Any

import pytest
from known_arcs import lit_types
from web_browser import Finger
from web_page import ALL_SIZES, Wheels, card, page_at, stop_button, take
from web_stage import Stage

from backbone.component_database.messages import ComponentType
from backbone.dependency_database.messages import Resource
from backbone.keys import Conversation
from backbone.naming import Subsystem
from resource_pool.arcs.drive import DriveArc
from resource_pool.arcs.skeleton import LitDriveArc
from resource_pool.commands import Move
from resource_pool.messages import Readings

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

CAPTURE = ComponentType(
    "capture", "x:Y", Subsystem.RESOURCE_POOL, needs=DriveArc.kinds(), abilities=DriveArc.abilities()
)
HANDS = ("pad", "halt", "release", "stop-mine", "speed")
HARDWARE = [Resource(f"{kind}1", kind) for kind in LitDriveArc.kinds().values()]


OTHERS = """() => {
  const buttons = [...document.querySelectorAll("#thumbs .robot button, #map button, #tabs button")];
  const seen = buttons.filter((one) => one.checkVisibility());
  return Object.fromEntries(seen.map((one) => {
    const { x, y } = one.getBoundingClientRect();
    return [`${one.closest(".robot")?.dataset.robot ?? ""} ${one.textContent}`, [x, y + scrollY]];
  }));
}"""
"""The places of the buttons that are not the hand's, on the page."""


async def centers(page: Any, *names: str) -> dict[str, tuple[int, int]]:
    """Return where a finger would press these."""
    boxes = {name: await page.locator(f"#{name}").bounding_box() for name in names}
    return {name: (round(box["x"] + box["width"] / 2), round(box["y"] + 10)) for name, box in boxes.items()}


async def ask_for_it(stage: Stage, page: Any) -> None:
    """Press the button; the robot is not granted yet."""
    stage.placer.on_arc = lambda arc: None
    await card(page).get_by_role("button", name="Take over").click()
    await page.wait_for_selector("body.is-asking")


async def grant(stage: Stage, page: Any) -> None:
    """Grant what the page asks for."""
    for arc in stage.placer.arcs.values():
        await arc.grant()
    await page.wait_for_selector("body[data-held=scout1]")


@pytest.mark.parametrize("size", ALL_SIZES)
async def test_pad_and_buttons_stay_when_the_robot_is_granted_and_when_its_commands_are_known(
    stage: Stage, size: str
) -> None:
    async with page_at(stage, size) as page:
        await ask_for_it(stage, page)
        waiting = await centers(page, "pad", "halt", "release")
        await grant(stage, page)
        assert await centers(page, "pad", "halt", "release") == waiting, "granted"
        held = await centers(page, *HANDS)
        stage.know_commands([CAPTURE, *lit_types("lit_drive")], HARDWARE)
        await page.locator("#commands").wait_for()
        assert await centers(page, *HANDS) == held, "commands known"


@pytest.mark.parametrize("size", ["desktop", "tablet"])
async def test_the_buttons_of_other_robots_stay_when_a_robot_is_granted_and_when_its_commands_are_known(
    stage: Stage, size: str
) -> None:
    async with page_at(stage, size) as page:
        await ask_for_it(stage, page)
        waiting = await page.evaluate(OTHERS)
        assert "scout2 Stop" in waiting
        await grant(stage, page)
        assert await page.evaluate(OTHERS) == waiting, "granted"
        stage.know_commands([CAPTURE, *lit_types("lit_drive")], HARDWARE)
        await page.get_by_role("combobox", name="Taken with").wait_for()
        await page.locator("#commands").wait_for()
        assert await page.evaluate(OTHERS) == waiting, "commands known"


BUTTONS = """() => [...document.querySelectorAll(".robot .row button, #pad")].map((one) => {
  const { x, y } = one.getBoundingClientRect();
  return [x, y + scrollY];
})"""
"""The places of the pad and of the buttons on all cards, on the page."""


@pytest.mark.parametrize("size", ALL_SIZES)
async def test_no_button_moves_when_robots_begin_to_report_and_when_they_end(stage: Stage, size: str) -> None:
    async with page_at(stage, size) as page:
        before = await page.evaluate(BUTTONS)
        for robot in ("scout1", "scout2", "scout3"):
            bus = stage.robots[robot].bus
            values = {"battery_share": 0.87, "motor_load": 0.05}
            bus.publish(bus.source, Conversation.READINGS, Readings(robot, stage.clock.now_s(), values))
        await card(page, "scout3").locator(".gauges", has_text="battery 87 %").wait_for()
        assert await page.evaluate(BUTTONS) == before
        shown, ended = await page.evaluate(REPORTS_THAT_END)
        assert ended == shown > 0


REPORTS_THAT_END = """async () => {
  const { Gauges } = await import("./gauges.js");
  const reports = new Gauges("scout1");
  document.querySelector(".robot").append(reports.root);
  reports.show([{ name: "battery", text: "87 %", share: 0.87, flag: null, span: "", doc: "", is_share: true }]);
  reports.root.open = true;
  const shown = reports.root.offsetHeight;
  reports.show([]);
  return [shown, reports.root.offsetHeight];
}"""
"""The heights of an open list of reports, and after the last of them."""


PLACES = """names => {
  const places = () => {
    scrollTo(0, 0);
    return names.map((name) => document.getElementById(name).getBoundingClientRect()).map((box) => [box.x, box.y]);
  };
  const before = places();
  for (const id of ["lost", "consent", "orders", "let-go", "blind", "unsure"])
    document.getElementById(id).hidden = false;
  for (const id of ["taken", "lost-line", "consent-line", "asked", "own"])
    document.getElementById(id).textContent = "anna asks for scout1, because hers has lost its radio link. ".repeat(3);
  const line = document.createElement("span");
  line.textContent = "alarm: launcher is absent: it is silent, so what is shown may be old. ".repeat(9);
  document.getElementById("alarm-bar").replaceChildren(line);
  return [before, places()];
}"""
"""The places of controls before and after news that the operator did not ask for."""


@pytest.mark.parametrize("size", ALL_SIZES)
async def test_no_news_moves_a_control(stage: Stage, size: str) -> None:
    async with page_at(stage, size) as page:
        await take(page)
        below = [] if size == "phone" else ["thumbs", "tabs"]
        before, after = await page.evaluate(PLACES, [*HANDS, "stage", *below])
        assert after == before


@pytest.mark.parametrize("size", ALL_SIZES)
async def test_a_stop_that_is_not_certain_covers_no_button_that_stops(stage: Stage, size: str) -> None:
    async with page_at(stage, size) as page:
        await page.evaluate("() => scrollTo(0, 0)")
        await page.locator("#unsure").evaluate(
            "line => { line.hidden = false; line.textContent = 'NOT CERTAIN to have stopped: scout1, scout2, scout3'; }"
        )
        for robot in ("scout1", "scout2"):
            await stop_button(page, robot).click(trial=True)
        await page.locator("#stop-all").click(trial=True)


async def test_a_pad_that_moves_under_a_finger_turns_no_slow_finger_into_a_fast_one(stage: Stage) -> None:
    async with page_at(stage, "tablet") as page:
        await take(page)
        wheels = Wheels(stage)
        await page.locator("#pad").scroll_into_view_if_needed()
        box = await page.locator("#pad").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + 0.4 * box["height"]
        finger = Finger(page)
        await finger.put_down(x, y)
        await wheels.wait_turning()
        slow = wheels.news[-1]
        assert isinstance(slow, Move)
        await page.locator("#news").evaluate("news => { news.style.height = '18rem'; }")
        assert (await page.locator("#pad").bounding_box())["y"] > box["y"] + box["height"] / 4, "it moved"
        await finger.move(x, y - 1)
        wheels.forget()
        await wheels.wait_turning()
        assert wheels.news[-1].forward_m_s == pytest.approx(slow.forward_m_s, rel=0.2)
        await finger.lift()
