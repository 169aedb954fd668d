"""A console refuses a new value of what it reads only when it begins."""

from __future__ import annotations

from typing import Any

import pytest
from driven_console import console
from fake_resource_pool import FakePlacer

from backbone.component.messages import Parameters, SetParameter, WrongParameter


@pytest.mark.parametrize(("name", "value"), [("robot", "scout2"), ("kind", "drive"), ("away_after_s", 5.0)])
def test_a_parameter_that_a_console_reads_once_is_not_set_in_vain(
    placer_world: Any, beside: Any, name: str, value: object
) -> None:
    async def scene(placer: FakePlacer) -> None:
        async with beside(console(placer, lambda event: None)) as driven:
            await placer.wait(lambda: placer.arcs)
            with pytest.raises(WrongParameter, match=f"cannot change {name} while it runs"):
                await placer.bus.ask(driven.address, SetParameter(name, value), Parameters, within_s=1.0)

    placer_world(scene)
