"""The designer's page loses its connection in the middle of a change, and gets it back."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
import web_browser
from design_hands import ROOT, Hands, Mouse, served
from web_browser import Cable

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180), pytest.mark.thorough]


@asynccontextmanager
async def page_by_cable(file: Path) -> AsyncIterator[tuple[Any, Cable]]:
    """Open the page of this file's designer; yields it and its cable to the server."""
    with served(file) as address:
        port = urlsplit(address).port
        assert port is not None
        async with Cable(port).plugged_in() as cable:
            cabled = address.replace(f":{port}/", f":{cable.port}/")
            async with web_browser.page_at("desktop", cabled, shows=".element") as page:
                yield page, cable


async def lose_connection(page: Any, cable: Cable) -> None:
    """Return once the page has noticed the loss and is connected again."""
    cable.is_cut = True
    await page.locator("#link").get_by_text("NOT CONNECTED").wait_for()
    cable.is_cut = False
    await page.locator("#link").get_by_text("connected", exact=True).wait_for()


async def test_a_value_that_is_lost_with_the_connection_is_told_and_enter_sends_it_again(tmp_path: Path) -> None:
    async with page_by_cable(tmp_path / "guard.xml") as (page, cable):
        field = page.locator("#properties [data-key='priority']")
        await field.fill("11")
        cable.is_cut = True
        await field.press("Enter")
        await lose_connection(page, cable)
        await page.locator("#notices").get_by_text("it is not known whether this was done").wait_for()
        assert await field.input_value() == "11"
        await field.press("Enter")
        await page.wait_for_selector("#tree [data-told$='priority 11']")


async def test_the_chosen_element_and_what_is_written_there_outlive_the_connection(tmp_path: Path) -> None:
    file = tmp_path / "guard.xml"
    file.write_bytes((ROOT / "mission.xml").read_bytes())
    async with page_by_cable(file) as (page, cable):
        await Mouse(page).choose("resource scout2 scout")
        field = page.locator("#properties [data-key='name']")
        await field.fill("scout4")
        await lose_connection(page, cable)
        await Hands(page).settle()
        assert await page.locator("#details-title").inner_text() == "resource scout2 scout"
        assert await field.input_value() == "scout4"
        await field.press("Enter")
        await Hands(page).see("resource scout4 scout")
