"""The types that the designer's JavaScript is checked by are those of what its server sends."""

from __future__ import annotations

from pathlib import Path

from design_stage import BEN, Page, serving
from made_files.page_types import DESIGNER
from msgspec import inspect
from sent_types import fits, odd


def write_elsewhere(file: Path) -> None:
    """Change the mission file by another program."""
    file.write_bytes(file.read_bytes() + b"<!-- theirs -->\n")


async def have_all_answered(anna: Page, file: Path) -> None:
    """Say what brings one answer of each kind."""
    await anna.change(do="take", path=anna.path("world world"), label="furniture")
    await anna.change(do="set", path=[], name="priority", value="11")
    await anna.change(do="save", name="../night.xml")
    write_elsewhere(file)
    await anna.change(do="save")
    await anna.change(do="save", overwrite=True)
    await anna.say(do="text")
    await anna.say(do="look_up", type="nothing")


async def test_what_the_designers_server_sends_has_the_types_that_the_page_is_checked_by(file: Path) -> None:
    async with serving(file) as served, served.page() as anna, served.page(BEN):
        await anna.say(do="rehearse", is_shown=True)
        await anna.say(do="beat", number=1)
        await anna.wait(lambda: anna.view.get("rehearsal") and "beat" in anna.view, "first minute and beat")
        await have_all_answered(anna, file)
        async with served.connection() as stranger:
            await stranger.send(b"nothing that is understood")
            await stranger.wait_closed()
        kinds = set(DESIGNER.answers)
        await anna.wait(lambda: {kind for one in anna.answers for kind in fits(one, DESIGNER.answers)} == kinds, "all")
        assert odd(anna.view, inspect.type_info(DESIGNER.view)) == []
        for answer in anna.answers:
            assert len(fits(answer, DESIGNER.answers)) == 1, answer
