"""A recording at the page of ``scout-console serve``, dragged, played, stepped and asked in a real browser."""

from __future__ import annotations

import subprocess
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from axe import serious_findings
from running_mission import BIN, mission_up
from small_recordings import recorded
from web_browser import assert_no_sideways_scroll, keep_picture, page_at

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

WITHIN_S = 30.0


@pytest.fixture(scope="module")
def night(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a recording of a mission in which two watchers took turns."""
    path = tmp_path_factory.mktemp("night") / "night.mcap"
    with mission_up("--record", str(path)) as mission:
        time.sleep(9.0)
        assert mission.down() == 0, mission.story()
    return path


@pytest.fixture
def address(night: Path) -> Iterator[str]:
    words = [str(BIN / "scout-console"), "serve", "--recording", str(night), "--port", "0"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        try:
            yield server.stdout.readline().strip()
        finally:
            server.terminate()
            assert server.wait(timeout=WITHIN_S) == 0


@asynccontextmanager
async def recording_at(address: str, size: str = "desktop", theme: str = "dark") -> AsyncIterator[Any]:
    async with page_at(size, address, shows="#playback:not([hidden]) .mark", theme=theme) as page:
        yield page


async def drag_to(page: Any, share: float) -> None:
    box = await page.locator("#play-line").bounding_box()
    y = box["y"] + box["height"] / 2
    await page.mouse.move(box["x"] + 3, y)
    await page.mouse.down()
    await page.mouse.move(box["x"] + box["width"] * share, y, steps=5)
    await page.mouse.up()


async def shown_s(page: Any) -> float:
    return float(await page.locator("#play-line").input_value())


async def wait_shown(page: Any, which: str) -> None:
    """Return when the time that is shown, ``at``, is one of these."""
    await page.wait_for_function(
        f"() => {{ const at = Number(document.getElementById('play-line').value); return {which}; }}"
    )


@pytest.mark.thorough
async def test_it_is_dragged_played_stepped_and_asked(address: str) -> None:
    async with recording_at(address) as page:
        await drag_to(page, 0.8)
        await page.wait_for_selector(".robot[data-robot=scout1]")
        there_s = await shown_s(page)
        assert there_s > 3.0
        await page.get_by_role("button", name="Play", exact=True).click()
        await wait_shown(page, f"at > {there_s} + 0.5")
        await page.get_by_role("button", name="Pause").click()
        await page.get_by_role("button", name="Play", exact=True).wait_for()
        await drag_to(page, 0.6)  # on a busy machine it may have played to its end, from which no step leads
        await wait_shown(page, f"at < {there_s}")
        stands_s = await shown_s(page)
        await page.get_by_role("button", name="Step").click()
        await wait_shown(page, f"at > {stands_s}")
        await page.locator(".mark.grant").first.click()
        await page.locator("#play-told").get_by_text("gets its resources").wait_for()
        await wait_shown(page, f"at < {there_s}")
        await page.locator("#play-why").click()
        await page.locator("#reading-lines").get_by_text("-capture: running").first.wait_for()
        await keep_picture(page, "recording-why")
        await page.locator("#reading").get_by_role("button", name="Close").click()
        assert await page.locator("button.emergency:visible").count() == 0
        assert await page.get_by_role("button", name="Take over").filter(visible=True).count() == 0


@pytest.mark.thorough
@pytest.mark.parametrize(("size", "theme"), [("desktop", "light"), ("phone", "dark")])
async def test_the_page_of_a_recording_is_accessible(address: str, size: str, theme: str) -> None:
    async with recording_at(address, size, theme) as page:
        await page.get_by_role("button", name="Next marker").click()
        await page.locator("#play-told").get_by_text("s:").wait_for()
        await page.wait_for_selector(".robot[data-robot=scout1]")
        await keep_picture(page, f"recording-{size}")
        await assert_no_sideways_scroll(page)
        assert await serious_findings(page) == []


@pytest.mark.parametrize("more", [("--mission", "night"), ("--design", "mission.xml")])
def test_a_recording_is_served_alone(tmp_path: Path, more: tuple[str, str]) -> None:
    (tmp_path / "night.mcap").write_bytes(recorded([]).getvalue())
    words = [str(BIN / "scout-console"), "serve", "--recording", str(tmp_path / "night.mcap"), *more]
    done = subprocess.run(words, capture_output=True, text=True, timeout=WITHIN_S, check=False)
    assert done.returncode == 2, done.stderr


def test_what_is_no_recording_is_refused_with_a_remedy(tmp_path: Path) -> None:
    (tmp_path / "no.mcap").write_bytes(b"something else")
    for name, code in (("no.mcap", "recording.unreadable"), ("missing.mcap", "usage.file")):
        words = [str(BIN / "scout-console"), "serve", "--recording", str(tmp_path / name), "--port", "0"]
        done = subprocess.run(words, capture_output=True, text=True, timeout=WITHIN_S, check=False)
        assert done.returncode != 0
        [line] = done.stderr.splitlines()
        assert line.startswith(f"refused [{code}]: {tmp_path / name}"), "one line names the file"
