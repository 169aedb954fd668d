"""Recordings of pictures in which somebody comes closer, for the example ``docs/examples/approach.py``."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from small_recordings import Said, recorded

from backbone.bus.clock import run_virtual
from backbone.keys import Conversation
from backbone.mission.reader import read_mission
from mission_control.laboratory.simulation.whole_mission import mission_in_one_process
from mission_control.messages import GreyPicture

EXAMPLES = Path(__file__).parents[1] / "docs" / "examples"
MISSION_XML = EXAMPLES / "approach.xml"
GUIDE = EXAMPLES.parent / "how-to" / "arrange-modules.md"
WATCH = "mission_control/watch"
AT = f"{WATCH}/picture"
KEY = f"{AT}/{Conversation.OUTPUTS}"
MODULES = ("average", "difference", "finder", "vote", "growth", "alarm")
KEYS = ("average", "difference", "found", "judged", "certain", "growing", "alarm")


def arrangements() -> dict[str, str]:
    """Return the ``<modules>`` of the example, and those of the guide, by their headings."""
    [shipped] = re.findall(r"<modules>.*?</modules>", MISSION_XML.read_text(), re.DOTALL)
    shown = re.findall(r"^## (.*?)$.*?(<modules>.*?</modules>)", GUIDE.read_text(), re.DOTALL | re.MULTILINE)
    return {"One unit": shipped, **dict(shown)}


def with_arrangement(modules: str, *, port: int = 7447) -> str:
    """Return the example's mission with other ``<modules>``, and with the hosts that they name."""
    text = re.sub(r"<modules>.*?</modules>", lambda _found: modules, MISSION_XML.read_text(), flags=re.DOTALL)
    names = sorted(set(re.findall(r'host="(\w+)"', modules)), reverse=True)  # the robot is the first
    ports = [f' port="{port}"', *[""] * len(names)]  # the hub is on the first
    hosts = "".join(f'<host name="{n}" address="127.0.0.1"{at}/>' for n, at in zip(names, ports, strict=False))
    return text.replace("<resources>", f"<hosts>{hosts}</hosts><resources>") if names else text


def drawn(count: int) -> io.BytesIO:
    """Return a recording of small pictures: a noisy wall, and before it a square that grows."""
    dice, pictures = np.random.default_rng(7), list[GreyPicture]()
    for number in range(count):
        pixels = dice.integers(60, 80, (72, 96)).astype(np.uint8)
        half = 4 + number // 2
        pixels[36 - half : 36 + half, 40 - half : 40 + half] = 150 + 40 * (number % 2)
        pictures.append(GreyPicture("scout1", number / 15, 96, 72, memoryview(pixels).cast("B")))
    return recording_of(pictures)


def simulated(for_s: float) -> io.BytesIO:
    """Return a recording of what the camera of the example's mission saw."""
    pictures: list[GreyPicture] = []

    async def main() -> None:
        async with mission_in_one_process(read_mission(MISSION_XML)) as running:
            running.bus.subscribe(AT, Conversation.OUTPUTS, GreyPicture, lambda one: pictures.append(one.body))
            await running.clock.sleep_s(for_s)

    run_virtual(main())
    return recording_of(pictures)


def recording_of(pictures: Iterable[GreyPicture]) -> io.BytesIO:
    """Return them as the watching behavior publishes them."""
    return recorded(Said(one.captured_s, AT, Conversation.OUTPUTS, one, WATCH) for one in pictures)
