"""The console's page in a real browser on the stage, and what a person does there."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
import web_browser
from web_browser import SIZES
from web_stage import Stage

from resource_pool.commands import Halt, Move

QUIET_S = 0.6  # twice what the server counts a drive for

GAMEPAD = """
window.held = new Set();
const buttons = () => Array.from({ length: 16 }, (_none, number) => ({ pressed: window.held.has(number) }));
const pad = () => ({ connected: true, axes: [1, 0, 0, 0], buttons: buttons() });
Object.defineProperty(navigator, "getGamepads", { value: () => [pad()] });
"""
SHOULDER = 5

COVERED = """() => {
  const ends = [0, document.documentElement.scrollHeight];
  const controls = [...document.querySelectorAll("button, input, select, [tabindex]")];
  const isAt = (one, box, share) => {
    const found = document.elementFromPoint(box.x + box.width / 2, box.y + share * box.height);
    return found === one || one.contains(found) || found?.contains(one);
  };
  const isThere = (one) => one.checkVisibility({ visibilityProperty: true }) && !one.disabled;
  return controls.filter(isThere).flatMap((one) => ends.flatMap((end) => {
    document.activeElement.blur();
    scrollTo(0, end);
    one.focus();
    const box = one.getBoundingClientRect();
    const isSeen = [0.2, 0.5, 0.8].some((share) => isAt(one, box, share));
    return isSeen ? [] : [`${one.id || one.textContent || one.className}, from ${end}`];
  }));
}"""
"""What gets the focus somewhere and cannot be seen there."""


@asynccontextmanager
async def page_at(stage: Stage, size: str = "desktop", **options: Any) -> AsyncIterator[Any]:
    """Open the page; scout1 to scout3 are there."""
    if not stage.robots:
        stage.place_robots("scout1", "scout2", "scout3")
    stage.grant_all()
    options.setdefault("address", stage.address)
    options.setdefault("may_be_kept", True)
    async with web_browser.page_at(size, shows=".robot[data-robot=scout1]", **options) as page:
        yield page


def card(page: Any, robot: str = "scout1") -> Any:
    return page.locator(f".robot[data-robot={robot}]")


def stop_button(page: Any, robot: str = "scout1") -> Any:
    return card(page, robot).locator("button.emergency")


async def take(page: Any, robot: str = "scout1") -> None:
    await card(page, robot).get_by_role("button", name="Take over").click()
    await page.wait_for_selector(f"body[data-held={robot}]")


async def wait_stopped(page: Any, robot: str = "scout1") -> None:
    await page.wait_for_selector(f".robot[data-robot={robot}].is-stopped")


async def wait_free(page: Any, robot: str = "scout1") -> None:
    await page.wait_for_selector(f".robot[data-robot={robot}]:not(.is-stopped)")


async def wait_until(is_so: Callable[[], Any], what: str, within_s: float = 10.0) -> None:
    """Return when it is so in the mission."""
    try:
        async with asyncio.timeout(within_s):
            while not is_so():  # noqa: ASYNC110  what a browser does gives no event here
                await asyncio.sleep(0.02)
    except TimeoutError:
        pytest.fail(f"never: {what}")


class Wheels:
    """Commands to the wheels of a robot."""

    def __init__(self, stage: Stage, robot: str = "scout1") -> None:
        self._stage, self._robot = stage, robot
        self._seen = 0

    @property
    def news(self) -> list[Any]:
        """Commands since ``forget``."""
        return [command for _at_s, command in self._stage.drives(self._robot)[self._seen :]]

    def forget(self) -> None:
        self._seen = len(self._stage.drives(self._robot))

    async def wait_turning(self) -> None:
        await wait_until(lambda: any(isinstance(one, Move) for one in self.news), "the wheels turn")

    async def wait_halted(self) -> None:
        await wait_until(lambda: self.news and isinstance(self.news[-1], Halt), "the wheels stop")

    async def assert_still(self, why: str) -> None:
        """Nothing turns them for a while."""
        self.forget()
        await asyncio.sleep(QUIET_S)
        assert not any(isinstance(one, Move) for one in self.news), why


class Key:
    """The key D."""

    def __init__(self, page: Any) -> None:
        self._page = page

    async def hold(self) -> None:
        await self._page.keyboard.down("d")

    async def let_go(self) -> None:
        await self._page.keyboard.up("d")


class Mouse:
    """A mouse on the drive pad."""

    def __init__(self, page: Any) -> None:
        self._page = page

    async def hold(self) -> None:
        box = await self._page.locator("#pad").bounding_box()
        await self._page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 10)
        await self._page.mouse.down()

    async def let_go(self) -> None:
        await self._page.mouse.up()


class Pad:
    """A gamepad, see ``GAMEPAD``, of which the shoulder button is held."""

    def __init__(self, page: Any) -> None:
        self._page = page

    async def plug_in(self) -> None:
        await self._page.evaluate("() => { dispatchEvent(new Event('gamepadconnected')); }")
        await self._page.wait_for_timeout(100)

    async def hold(self, button: int = SHOULDER) -> None:
        await self._page.evaluate("number => { window.held.add(number); }", button)

    async def let_go(self, button: int = SHOULDER) -> None:
        await self._page.evaluate("number => { window.held.delete(number); }", button)
        await self._page.wait_for_timeout(100)


HANDS: dict[str, Callable[[Any], Any]] = {"key": Key, "mouse": Mouse, "gamepad": Pad}
ALL_SIZES = tuple(SIZES)
