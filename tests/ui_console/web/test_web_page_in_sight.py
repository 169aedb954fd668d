"""On a phone or a tablet the driver sees picture, pad and stop buttons at once, whatever else the page shows."""

from __future__ import annotations

import pytest
from examples import rest_thorough
from known_arcs import lit_types
from web_browser import assert_no_sideways_scroll
from web_page import page_at, take, wait_free, wait_stopped
from web_stage import LOW, Stage

from backbone.component.abilities import Abilities, CommandForm, FieldForm, ValueKind
from backbone.component_database.messages import ComponentType
from backbone.dependency_database.messages import Resource
from backbone.naming import Subsystem
from resource_pool.arcs.drive import DriveArc
from resource_pool.arcs.skeleton import LitDriveArc

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

LONGEST = "scout-of-the-second-team-with-the-longest-name-that-is-possible"
SCREENS = [(360, 640), (844, 390), (768, 1024), (390, 844), (640, 360), (820, 1180)]
MANY = Abilities(
    commands=[
        *DriveArc.abilities().commands,
        *(
            CommandForm(f"show_{word}", [FieldForm("steps", ValueKind.WHOLE, least=1, most=9)], roles=["scout"])
            for word in ("one", "two", "three", "four")
        ),
    ]
)
HARDWARE = [Resource(f"{kind}1", kind) for kind in LitDriveArc.kinds().values()]

OUT_OF_SIGHT = """async ([isAll, more]) => {
  const grow = () => {
    for (const id of ["lost", "consent", "orders", "let-go", "health"]) document.getElementById(id).hidden = false;
    for (const id of ["taken", "lost-line", "consent-line", "asked", "own", "health", "applied"])
      document.getElementById(id).textContent = "anna asks for scout1, because hers has no radio link. ".repeat(3);
    const line = document.createElement("span");
    line.textContent = "alarm: launcher is absent: it is silent, so what is shown may be old. ".repeat(9);
    document.getElementById("alarm-bar").replaceChildren(line);
  };
  for (let frames = 0; frames < 3; frames += 1) {
    if (isAll) grow(); // the server's next message undoes it
    scrollTo(0, 0);
    await new Promise(requestAnimationFrame);
  }
  const needed = {
    picture: document.querySelector(".robot.is-large canvas"),
    ...Object.fromEntries(["pad", "stop-mine", "stop-all", ...more].map((id) => [id, document.getElementById(id)])),
  };
  const isSeen = (one) => {
    const { left, top, right, bottom } = one.getBoundingClientRect();
    const [x, y] = [(left + right) / 2, (top + bottom) / 2];
    const points = [[x, y], [left + 9, y], [right - 9, y], [x, top + 3], [x, bottom - 3]];
    const whole = one.closest(".screen") ?? one;
    return bottom - top > 30 && points.every((point) => whole.contains(document.elementFromPoint(...point)));
  };
  return Object.entries(needed).filter(([, one]) => !isSeen(one)).map(([name]) => name);
}"""


IS_IN_SIGHT = """(one) => {
  const box = one.getBoundingClientRect();
  return one.contains(document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2));
}"""


IS_WHOLE = """([state, name]) => {
  const health = document.getElementById("health");
  [health.hidden, health.textContent, document.getElementById("mission").textContent] = [false, state, name];
  return health.scrollWidth <= health.clientWidth;
}"""


@pytest.mark.parametrize(("width", "height"), SCREENS)
async def test_the_state_of_the_mission_is_never_cut_for_its_name(stage: Stage, width: int, height: int) -> None:
    stage.place_robots("scout1", LONGEST)
    async with page_at(stage, "phone", may_be_kept=False) as page:
        await page.set_viewport_size({"width": width, "height": height})
        await take(page, LONGEST)
        assert await page.evaluate(IS_WHOLE, ["mission degraded", LONGEST])
        await assert_no_sideways_scroll(page)


@pytest.mark.parametrize(("width", "height"), rest_thorough(SCREENS, 3))
async def test_commands_and_news_cover_neither_picture_nor_pad_nor_stops(stage: Stage, width: int, height: int) -> None:
    stage.place_robots("scout1", LONGEST)
    stage.know_commands(
        [
            ComponentType("capture", "x:Y", Subsystem.RESOURCE_POOL, needs=DriveArc.kinds(), abilities=MANY),
            *lit_types("lit_drive"),
        ],
        HARDWARE,
    )
    async with page_at(stage, "phone", may_be_kept=False) as page, stage.browser(LOW) as ben:
        await page.set_viewport_size({"width": width, "height": height})
        await take(page, LONGEST)
        await page.locator("#commands").wait_for(state="attached")
        await assert_no_sideways_scroll(page)
        assert await page.evaluate(OUT_OF_SIGHT, [False, []]) == [], "with commands"
        assert await page.evaluate(OUT_OF_SIGHT, [True, []]) == [], "with all news"
        await page.locator("#stop-mine").click()
        await wait_stopped(page, LONGEST)
        await ben.say(do="lift", robot=LONGEST, number=stage.robots[LONGEST].latch.state.number)
        await page.locator("#consent-line").get_by_text("ben asks").wait_for()
        assert await page.evaluate(OUT_OF_SIGHT, [False, ["consent-yes", "consent-no"]]) == [], "with a question"
        await page.locator("#consent-yes").click()
        await wait_free(page, LONGEST)
        await page.get_by_role("button", name="Show four").click(trial=True)


@pytest.mark.parametrize(("width", "height"), [(390, 844), (360, 640)])
async def test_on_an_upright_phone_no_scrolling_takes_pad_and_stops_away(stage: Stage, width: int, height: int) -> None:
    async with page_at(stage, "phone", may_be_kept=False) as page:
        await page.set_viewport_size({"width": width, "height": height})
        await take(page)
        for end in (0, 500, 100_000):
            await page.evaluate("end => scrollTo(0, end)", end)
            for control in ("pad", "stop-mine", "stop-all"):
                assert await page.locator(f"#{control}").evaluate(IS_IN_SIGHT), f"{control}, from {end}"
