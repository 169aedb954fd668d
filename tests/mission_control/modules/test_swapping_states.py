"""A module whose state has a class of its own file is exchanged for a new version: old and new code never mix."""

from __future__ import annotations

from typing import Any

import pytest
from test_swapping_modules import SOURCE, Play, Stage, play, stage

from backbone.bus.clock import VirtualClock

__all__ = ["play", "stage"]

MARK = """
from dataclasses import dataclass
import msgspec


@dataclass
class Mark:
    number: int = 0

    def raised(self, step):
        self.number += 1 * step
        return self.number


class Counter(Module):"""
WITH_MARK = (
    SOURCE.replace("class Counter(Module):", MARK)
    .replace("        number: int = 0\n\n", "        mark: Mark = msgspec.field(default_factory=Mark)\n\n")
    .replace("self.state.number += self.parameters.step", "number = self.state.mark.raised(self.parameters.step)")
    .replace("Count(self.state.number,", "Count(number,")
)


@pytest.fixture(autouse=True)
def with_mark(stage: Stage) -> None:
    stage.file.write_text(WITH_MARK)


def numbers(stage: Stage) -> list[int]:
    return [one.number for one in stage.counts]


def test_an_object_in_the_state_has_the_code_of_the_new_version(stage: Stage, play: Play) -> None:
    async def scene() -> None:
        before = numbers(stage)[-1]
        stage.file.write_text(WITH_MARK.replace("1 * step", "1000 * step"))
        swapped = await stage.swap(prove_s=0.5)
        assert (swapped.is_proved, swapped.keeps_state, swapped.remark) == (True, True, "")
        last, newest = numbers(stage)[-2:]
        assert newest - last == 1000
        assert newest % 1000 >= before % 1000, "it counts on from the old one's number"

    play(scene)


@pytest.mark.parametrize(
    ("edit", "cause"),
    [
        (("    number: int = 0", "    number: float = 0"), "Mark declares other fields than before"),
        (("@dataclass\nclass Mark:", "class Mark:"), "Mark declares other fields than before"),
    ],
)
def test_a_class_with_other_fields_begins_with_a_fresh_state_and_the_cause_is_told(
    stage: Stage, play: Play, edit: Any, cause: str
) -> None:
    async def scene() -> None:
        before = numbers(stage)[-1]
        stage.file.write_text(WITH_MARK.replace(*edit))
        swapped = await stage.swap(prove_s=0.0)
        assert (swapped.is_proved, swapped.keeps_state, swapped.remark) == (
            True,
            False,
            f"its state is fresh, because {cause}",
        )
        await VirtualClock().sleep_s(0.1)
        assert numbers(stage)[-1] < before
        assert any(cause in what for _level, what in await stage.story())

    play(scene)
