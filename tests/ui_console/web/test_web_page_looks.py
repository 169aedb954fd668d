"""How the page looks and is reached: sizes, themes, keyboard alone, and axe-core's findings."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from axe import serious_findings
from examples import rest_thorough
from web_browser import assert_no_sideways_scroll
from web_page import ALL_SIZES, COVERED, card, page_at, stop_button, take, wait_stopped
from web_stage import LOW, Stage

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

LONG = "a-robot-with-a-rather-long-name-of-its-own"


@pytest.mark.parametrize(("size", "share"), rest_thorough([("phone", 0.85), ("desktop", 0.5), ("tablet", 0.9)]))
async def test_the_robot_in_hand_is_large_and_the_others_are_small(stage: Stage, size: str, share: float) -> None:
    async with page_at(stage, size) as page:
        await take(page, "scout2")
        await page.wait_for_selector(".robot.is-large[data-robot=scout2]")
        large = await card(page, "scout2").locator("canvas").bounding_box()
        small = await card(page, "scout1").locator("canvas").bounding_box()
        assert large["width"] >= share * page.viewport_size["width"]
        assert small["width"] <= large["width"] / 2
        assert large["y"] + large["height"] <= page.viewport_size["height"], "seen whole"
        await assert_no_sideways_scroll(page)


@pytest.mark.parametrize("size", rest_thorough(reversed(ALL_SIZES)))
async def test_while_a_robot_is_driven_its_stop_and_that_of_all_are_in_sight_and_nothing_covers_them(
    stage: Stage, size: str
) -> None:
    async with page_at(stage, size) as page:
        await take(page)
        for button in ("stop-mine", "stop-all"):
            is_free = await page.evaluate(
                """id => {
                  const one = document.getElementById(id), box = one.getBoundingClientRect();
                  return document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2) === one;
                }""",
                button,
            )
            assert is_free, button
        await page.locator("#stop-mine").click()
        await wait_stopped(page)


@pytest.mark.parametrize("size", rest_thorough(reversed(ALL_SIZES)))
async def test_long_words_of_people_push_no_button_off_the_screen(stage: Stage, size: str) -> None:
    async with page_at(stage, size) as page:
        await take(page)
        stage.robots["scout1"].stop("n" * 63, "console", f"see {'w' * 63}")
        await page.locator("#own", has_text="wwww").wait_for()
        await assert_no_sideways_scroll(page)


async def test_without_a_robot_the_one_that_was_chosen_is_large(stage: Stage) -> None:
    async with page_at(stage) as page:
        await page.wait_for_selector(".robot.is-large[data-robot=scout1]")
        await page.get_by_role("button", name="Show scout3 large").click()
        await page.wait_for_selector(".robot.is-large[data-robot=scout3]")
        assert await page.locator(".robot.is-large").count() == 1


async def test_on_a_phone_hands_are_there_only_with_a_robot_and_no_words_are_cut_into_letters(stage: Stage) -> None:
    stage.place_robots("scout1", LONG)
    async with page_at(stage, "phone") as page:
        await page.wait_for_selector(".robot")
        assert await page.locator("#pad").is_hidden()
        for table in ("alarms", "robots", "schedule", "components", "log"):
            await page.locator(f"#tab-{table}").click()
            await asyncio.sleep(0.1)
            narrow = await page.evaluate("""() => [...document.querySelectorAll(".holder, .state, td")]
              .filter((one) => one.textContent.trim().length > 8 && one.checkVisibility())
              .map((one) => [one.textContent, one.clientWidth]).filter(([, width]) => width < 90)""")
            assert narrow == [], table
            await assert_no_sideways_scroll(page)
        await take(page)
        assert await page.locator("#pad").is_visible()


async def test_labels_of_the_timeline_tell_robots_apart(stage: Stage) -> None:
    async with page_at(stage) as page:
        labels = await page.evaluate("""async () => {
          const { timeline } = await import("./timeline.js");
          const slice = (who) => ({ who, from_s: 0, to_s: 3, certainty: "now", is_console: false });
          const row = (n) => ({ rc: `video-frequency-of-the-team-${n}`, slices: [slice(`watch-scout${n}`)] });
          const drawn = timeline({ from_s: 0, now_s: 1, to_s: 30, rows: [row(1), row(2)] }, 900);
          return [...drawn.querySelectorAll("text")].map((one) => one.firstChild.textContent);
        }""")
        names, whose = labels[0:4:2], labels[1:4:2]
        assert len(set(names)) == len(set(whose)) == 2
        assert [name[-1] for name in names] == [one[-1] for one in whose] == ["1", "2"]


async def test_the_look_is_the_systems_unless_this_browser_was_told_otherwise(stage: Stage) -> None:
    async def ground(page: Any) -> str:
        found: str = await page.evaluate("() => getComputedStyle(document.documentElement).backgroundColor")
        return found

    async with page_at(stage, theme="light") as page:
        light = await ground(page)
        await page.emulate_media(color_scheme="dark")
        await page.wait_for_selector("html[data-theme=dark]")
        dark = await ground(page)
        assert light != dark
        await page.locator("#theme").select_option("light")
        assert await ground(page) == light
        await page.reload()
        await page.wait_for_selector(".robot")
        assert await ground(page) == light


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("size", "theme"),
    [
        ("desktop", "light"),
        ("phone", "dark"),
        *(
            pytest.param(size, theme, marks=pytest.mark.slow)
            for size, theme in (("desktop", "dark"), ("tablet", "light"), ("tablet", "dark"), ("phone", "light"))
        ),
    ],
)
async def test_axe_finds_nothing_serious(stage: Stage, size: str, theme: str) -> None:
    async with page_at(stage, size, theme=theme) as page, stage.browser(LOW) as ben:
        found = {"watching": await serious_findings(page)}
        await take(page)
        await ben.say(do="stop_robot", robot="scout1")
        await stop_button(page, "scout2").click()
        await wait_stopped(page)
        await wait_stopped(page, "scout2")
        for table in ("robots", "timeline", "log"):
            await page.locator(f"#tab-{table}").click()
            await asyncio.sleep(0.1)
            found[table] = await serious_findings(page)
        await card(page).get_by_role("button", name="Why").click()
        await page.wait_for_selector("dialog[open]")
        found["dialog"] = await serious_findings(page)
        await page.keyboard.press("Escape")
        for element in ("#lost", "#consent", "#let-go", "#unsure", "#login", "#blind"):
            await page.evaluate(f"() => {{ document.querySelector('{element}').hidden = false; }}")
        await page.evaluate("""() => {
          document.body.classList.add("is-blind");
          for (const id of ["lost-line", "blind-title", "consent-line", "unsure"])
            document.getElementById(id).textContent = "something to read";
        }""")
        found["cut off"] = await serious_findings(page)
        assert {state: findings for state, findings in found.items() if findings} == {}


async def test_all_that_can_be_pressed_is_reached_by_tab_alone_and_seen_to_have_the_focus(stage: Stage) -> None:
    async with page_at(stage) as page:
        await stop_button(page, "scout2").click()
        await wait_stopped(page, "scout2")
        await page.evaluate("() => document.activeElement.blur()")
        name_of = "const nameOf = (one) => one.dataset.key ?? one.ariaLabel ?? (one.id || one.textContent);"
        reached, unseen = set(), set()

        async def not_reached() -> set[str]:
            pressable = await page.evaluate(f"""() => {{
              {name_of}
              const all = [...document.querySelectorAll("button, input, select, [tabindex='0']")];
              const isThere = (one) => one.checkVisibility({{ visibilityProperty: true }}) && !one.disabled;
              return all.filter(isThere).map(nameOf);
            }}""")
            return set(pressable) - reached

        for number in range(240):  # three times around: an alarm that comes meanwhile has a button, too
            if number >= 80 and number % 20 == 0 and not await not_reached():
                break
            await page.keyboard.press("Tab")
            name, is_seen = await page.evaluate(f"""() => {{
              {name_of}
              const one = document.activeElement, style = getComputedStyle(one);
              const isSeen = style.outlineStyle !== "none" && parseFloat(style.outlineWidth) >= 2;
              return [nameOf(one), isSeen || one === document.body];
            }}""")
            reached.add(name)
            if not is_seen:
                unseen.add(name)
        assert unseen == set()
        assert await not_reached() == set()


@pytest.mark.thorough
async def test_by_keyboard_alone_a_robot_is_taken_stopped_lifted_and_released(stage: Stage) -> None:
    async with page_at(stage) as page:
        keyboard = page.keyboard
        await card(page).get_by_role("button", name="Take over").focus()
        await keyboard.press("Enter")
        await page.wait_for_selector("body[data-held=scout1]")
        await stop_button(page).focus()
        await keyboard.press("Enter")
        await wait_stopped(page)
        await card(page).locator(".lift").focus()
        await keyboard.down("Enter")
        await page.wait_for_selector(".robot[data-robot=scout1]:not(.is-stopped)")
        await keyboard.up("Enter")
        await page.locator("#release").focus()
        await keyboard.press("Enter")
        await page.wait_for_selector("body[data-held='']")


@pytest.mark.parametrize("size", rest_thorough(reversed(ALL_SIZES)))
async def test_what_gets_the_focus_is_not_hidden_below_what_stays_on_the_screen(stage: Stage, size: str) -> None:
    async with page_at(stage, size) as page:
        await take(page)
        assert await page.evaluate(COVERED) == []


NAMES = """(place) => [...document.querySelectorAll(`${place} button`)]
    .filter((one) => one.checkVisibility())
    .map((one) => one.getAttribute("aria-label") ?? one.textContent.trim())"""


async def test_no_two_robots_and_no_two_rows_of_a_table_have_buttons_of_one_name(stage: Stage) -> None:
    """A person who hears the page, or speaks to it, could not tell them apart."""
    async with page_at(stage) as page:
        await take(page)
        names = await page.evaluate(NAMES, ".robot")
        assert {"Yours scout1", "Take over scout2"} <= set(names)
        for shown in (names, await page.evaluate(NAMES, "#tables")):
            assert [name for name in set(shown) if shown.count(name) > 1] == []
