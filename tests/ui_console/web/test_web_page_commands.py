"""On the page each command of the robot in hand has a button, and each of its fields a control."""

from __future__ import annotations

import pytest
from axe import serious_findings
from known_arcs import lit_types
from web_page import COVERED, Wheels, page_at, take, wait_free, wait_stopped, wait_until
from web_stage import Stage

from backbone.component.abilities import Abilities, CommandForm, FieldForm, ValueKind
from backbone.component_database.messages import ComponentType
from backbone.dependency_database.messages import Resource
from backbone.naming import Subsystem
from resource_pool.arcs.drive import DriveArc
from resource_pool.arcs.skeleton import LitDriveArc
from resource_pool.messages import GiveCommand

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]


def given(stage: Stage) -> list[GiveCommand]:
    return [command for _at_s, command in stage.drives() if isinstance(command, GiveCommand)]


async def test_a_lamp_is_dimmed_by_a_slider_by_hand_and_by_keyboard_and_what_was_applied_is_shown(stage: Stage) -> None:
    stage.know_commands()
    async with page_at(stage) as page:
        await take(page)
        slider = page.get_by_role("slider", name="brightness, 0 to 1")
        await slider.fill("0.3")
        await page.get_by_role("button", name="Shine").click()
        await wait_until(lambda: given(stage) == [GiveCommand("shine", {"brightness": 0.3}, "lamp")], "dimmed")
        await page.locator("#applied", has_text="shine brightness 0.3").wait_for()
        wheels = Wheels(stage)
        await slider.focus()
        for _step in range(5):
            await page.keyboard.press("ArrowRight")
        await page.keyboard.press("Enter")
        await wait_until(lambda: len(given(stage)) == 2, "dimmed by keyboard")
        assert given(stage)[-1].values == {"brightness": pytest.approx(0.35)}
        await wheels.assert_still("the arrows are the slider's")
        await page.keyboard.press("x")
        await wait_until(lambda: stage.robots["scout1"].is_stopped, "x stops with the focus on a slider")


FIELDS = [
    FieldForm("gait", ValueKind.TEXT, default="walk", choices=["walk", "trot"]),
    FieldForm("lit", ValueKind.FLAG, default=True),
    FieldForm("steps", ValueKind.WHOLE, least=1, most=9, is_required=True),
    FieldForm("for_s", ValueKind.NUMBER, "s", least=0.0, default=2.5),
    FieldForm("said", ValueKind.TEXT, default="", doc="Read aloud."),
]


async def test_each_kind_of_field_has_its_control_and_an_arc_without_a_body_has_no_stick(stage: Stage) -> None:
    able = Abilities(commands=[CommandForm("show_off", FIELDS, roles=["dog"])])
    stage.know_commands(
        [ComponentType("capture", "x:Y", Subsystem.RESOURCE_POOL, needs={"dog": "dog"}, abilities=able)]
    )
    async with page_at(stage) as page:
        await take(page)
        await page.get_by_role("combobox", name="gait: walk, trot").select_option("trot")
        await page.get_by_role("switch", name="lit, yes or no").click()
        await page.get_by_role("slider", name="steps, 1 to 9").fill("4")
        assert await page.get_by_role("spinbutton", name="for, at least 0 s").input_value() == "2.5"
        await page.get_by_role("textbox", name="said").fill("hello")
        await page.keyboard.press("x")
        await wait_until(lambda: stage.robots["scout1"].is_stopped, "x is not written")
        stage.robots["scout1"].free()
        await wait_free(page)
        wheels = Wheels(stage)
        await page.get_by_role("button", name="Show off").click()
        values = {"gait": "trot", "lit": False, "steps": 4, "for_s": 2.5, "said": "hello"}
        await wait_until(lambda: given(stage) == [GiveCommand("show_off", values, "dog", after_stop=1)], "given")
        await page.keyboard.press("ArrowUp")
        assert await page.locator("#pad").get_attribute("aria-disabled") == "true"
        await wheels.assert_still("it has no body that moves")


async def test_a_text_that_the_server_would_not_read_is_not_sent_and_the_robot_stays_in_hand(stage: Stage) -> None:
    able = Abilities(commands=[CommandForm("show_off", FIELDS, roles=["dog"])])
    stage.know_commands(
        [ComponentType("capture", "x:Y", Subsystem.RESOURCE_POOL, needs={"dog": "dog"}, abilities=able)]
    )
    async with page_at(stage) as page:
        await take(page)
        said, show_off = page.get_by_role("textbox", name="said"), page.get_by_role("button", name="Show off")
        await said.fill("a" * 5000)
        await show_off.click()
        await page.get_by_text("TOO LONG: give was not sent.").wait_for()
        await said.fill("hello")
        await show_off.click()
        await wait_until(lambda: [one.values["said"] for one in given(stage)] == ["hello"], "the short one alone")
        assert len(stage.placer.arcs) == 1


async def test_a_number_that_the_field_cannot_have_is_marked_there_and_not_sent(stage: Stage) -> None:
    able = Abilities(commands=[CommandForm("show_off", FIELDS, roles=["dog"])])
    stage.know_commands(
        [ComponentType("capture", "x:Y", Subsystem.RESOURCE_POOL, needs={"dog": "dog"}, abilities=able)]
    )
    async with page_at(stage) as page:
        await take(page)
        for_s, show_off = page.get_by_role("spinbutton", name="for, at least 0 s"), page.get_by_text("Show off")
        for number in ("99999999999999999999", "1e300", "-5"):
            await for_s.fill(number)
            await show_off.click()
            assert await for_s.evaluate("field => field.matches(':invalid')"), number
        await for_s.fill("2")
        await show_off.click()
        await wait_until(lambda: [one.values["for_s"] for one in given(stage)] == [2], "the possible one alone")
        assert not any("means nothing" in alarm.line for alarm in stage.hub.team.alarms.views())


async def test_another_kind_of_arc_for_the_robot_in_hand_brings_its_commands(stage: Stage) -> None:
    plain = ComponentType(
        "capture", "x:Y", Subsystem.RESOURCE_POOL, needs=DriveArc.kinds(), abilities=DriveArc.abilities()
    )
    hardware = [Resource(f"{kind}1", kind) for kind in LitDriveArc.kinds().values()]
    stage.know_commands([plain, *lit_types("lit_drive")], hardware)
    async with page_at(stage) as page:
        kind, anew = page.get_by_role("combobox", name="Taken with"), page.get_by_role("button", name="Take anew")
        assert await kind.is_hidden()
        await take(page)
        await kind.locator("option").first.wait_for(state="attached")
        assert await kind.locator("option").all_text_contents() == [
            "capture: command radio, scout",
            "lit drive: command radio, lamp, scout",
        ]
        assert await page.get_by_role("button", name="Shine").count() == 0
        assert await page.evaluate(COVERED) == []
        assert await anew.is_disabled(), "it is taken so"
        await kind.focus()
        await page.keyboard.press("ArrowDown")
        await anew.click()
        await page.get_by_role("button", name="Shine").wait_for()
        await page.wait_for_selector("body[data-held=scout1]")
        await page.get_by_role("slider", name="brightness, 0 to 1").fill("0.3")
        await page.get_by_role("button", name="Shine").click()
        await wait_until(lambda: given(stage) == [GiveCommand("shine", {"brightness": 0.3}, "lamp")], "dimmed")
        await take(page, "scout2")
        assert [name.rpartition("-")[2] for name in stage.placer.arcs] == ["capture"]
        await kind.wait_for()
        # Last: on a full machine this keeps the page busy for so long that it counts as gone, and loses its robot.
        assert await serious_findings(page) == []


async def test_commands_count_while_a_robot_is_held_and_the_speed_tells_the_robots_own(stage: Stage) -> None:
    stage.know_commands()
    async with page_at(stage) as page:
        assert await page.locator("#commands").is_hidden()
        await take(page)
        await page.locator("#speed-shown", has_text="25 % (0.09 m/s)").wait_for()  # its abilities come a moment later
        await page.get_by_role("button", name="Jump").click()
        await wait_until(lambda: given(stage) == [GiveCommand("jump", {}, "scout")], "jumps")
        await page.locator("#release").click()
        await page.wait_for_selector("body[data-held='']")
        assert await page.locator("#commands button:enabled").count() == 0


async def test_a_command_from_before_a_stop_is_not_given_and_the_page_says_so(stage: Stage) -> None:
    stage.place_robots("scout1")
    stage.grant_all()
    async with stage.browser() as anna:
        await anna.say(do="take", robot="scout1")
        await anna.wait(lambda: anna.is_held, "held")
        pressed_at = anna.view["own"]["moment"]
        stage.robots["scout1"].stop("ben", "")
        await anna.wait(lambda: anna.view["own"]["stop"], "stopped")
        stage.robots["scout1"].free()
        await anna.wait(lambda: not anna.view["own"]["stop"], "free")
        await anna.say(do="give", moment=pressed_at, word="jump", values={}, role="")
        await anna.wait(lambda: anna.answers, "answered")
        assert "press again" in anna.answers[0]["refused"]
        assert not given(stage)


@pytest.mark.thorough
@pytest.mark.parametrize("size", ["desktop", "phone"])
async def test_controls_of_commands_are_large_reached_by_focus_and_axe_finds_nothing_serious(
    stage: Stage, size: str
) -> None:
    stage.know_commands()
    async with page_at(stage, size) as page:
        await take(page)
        await page.locator("#commands button").first.wait_for()
        heights = await page.evaluate("""() => [...document.querySelectorAll("#commands button, #commands input")]
          .map((one) => one.getBoundingClientRect().height)""")
        assert len(heights) == 3
        assert min(heights) >= 44
        assert await page.evaluate(COVERED) == []
        assert await serious_findings(page) == []
        await page.locator("#stop-mine").click()
        await wait_stopped(page)
