"""Units on a bus that loses everything between components: each goes on with what it has in itself."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from contextlib import AsyncExitStack
from itertools import pairwise
from typing import Any

import msgspec
import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from sample_modules import Number

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import Answered, Listening, LocalNetwork, Watching
from backbone.component.launch import Launch
from backbone.naming import Subsystem
from backbone.wire import Envelope, Message
from mission_control.modules.arrangement import UnitOrder, arranged
from mission_control.modules.module import Module
from mission_control.modules.orders import ModuleOrder, UnitParameters
from mission_control.modules.unit_component import UnitComponent
from mission_control.modules.unit_schedule import OnInput

RATE_HZ = 20.0
CHAIN = ("counter", "doubler", "summing", "follower", "actuator")
DONE: list[tuple[float, float]] = []
"""Virtual time and value of each command that reached the hardware."""


class Actuator(Module):
    """Hardware at the end of the chain."""

    class Inputs(Module.Inputs):
        place: Number

    class Outputs(Module.Outputs):
        done: Number

    def update(self, inputs: Inputs) -> Outputs:
        DONE.append((VirtualClock().now_s(), inputs.place.value))
        return self.Outputs(inputs.place)


ORDERS = {
    name: ModuleOrder(name, f"{__name__}:Actuator" if name == "actuator" else f"sample_modules:{name.capitalize()}")
    for name in CHAIN
}


class SeverableNetwork(LocalNetwork):
    """Loses everything that goes from one component to another while it ``is_cut``."""

    is_cut = False

    def carry_question(self, address: str, asked: Envelope[Message], answered: Answered) -> None:
        if not self.is_cut:
            super().carry_question(address, asked, answered)

    def carry_publication(self, listening: Listening, address: str, envelope: Envelope[Message]) -> None:
        if not self.is_cut or listening.owner.source == envelope.source:
            super().carry_publication(listening, address, envelope)

    def carry_life(self, watching: Watching, address: str, alive: bool) -> None:
        if not self.is_cut or watching.owner.source == address:
            super().carry_life(watching, address, alive)


def component(network: LocalNetwork, name: str, parameters: UnitParameters) -> UnitComponent:
    launch = Launch(
        network.mission,
        Subsystem.MISSION_CONTROL,
        name,
        "execution_unit",
        "",
        "local",
        "",
        0.0,
        1.0,
        msgspec.to_builtins(parameters),
    )
    clock = VirtualClock()
    return UnitComponent(launch, network.join(launch.address, clock), clock)


def lived(
    local_mission: Any, beside: Any, units: Mapping[str, UnitParameters]
) -> tuple[dict[str, dict[str, list[float]]], dict[str, dict[str, float]]]:
    """Return unit → module → its runs in three seconds before, during and after the cut, and the statistics."""
    runs: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    DONE.clear()

    async def main() -> dict[str, dict[str, float]]:
        network, clock = SeverableNetwork(), VirtualClock()
        async with AsyncExitStack() as stack:
            await stack.enter_async_context(local_mission(network=network))
            started = {
                name: await stack.enter_async_context(beside(component(network, name, one)))
                for name, one in units.items()
            }
            await clock.sleep_s(0.01)
            for network.is_cut in (False, True, False):
                before = {name: unit.statistics() for name, unit in started.items()}
                await clock.sleep_s(3.0)
                for name, unit in started.items():
                    after = unit.statistics()
                    for module in (one.name for one in units[name].modules):
                        runs[name][module].append(after[f"{module}_runs"] - before[name][f"{module}_runs"])
            return {name: unit.statistics() for name, unit in started.items()}

    return runs, run_virtual(main())


@settings(max_examples=share(60))
@given(
    places=st.lists(st.integers(0, 4), min_size=5, max_size=5), threads=st.lists(st.booleans(), min_size=5, max_size=5)
)
def test_a_unit_goes_on_with_what_it_has_in_itself_and_the_others_join_again(
    local_mission: Any, beside: Any, places: list[int], threads: list[bool]
) -> None:
    inside: dict[int, list[ModuleOrder]] = defaultdict(list)
    for name, place in zip(CHAIN, places, strict=True):
        inside[place].append(ORDERS[name])
    orders = [UnitOrder(name=f"u{n}", modules=of, own_thread=threads[n]) for n, of in inside.items()]
    orders[0] = msgspec.structs.replace(orders[0], frequency_hz=RATE_HZ, on_input=OnInput.NONE)
    runs, at_the_end = lived(local_mission, beside, arranged(orders, {}))
    alone = next((n for n, place in enumerate(places) if place != places[0]), len(places))
    share_of = {"counter": 1.0, "doubler": 1.0, "summing": 1.0, "follower": 0.5, "actuator": 0.5}  # every second sum
    for unit, modules in runs.items():
        assert at_the_end[unit]["missed"] == 0
        for module, counts in modules.items():
            full = 3.0 * RATE_HZ * share_of[module]
            goes_on = CHAIN.index(module) < alone  # all before it is in the unit that the frequency drives
            during = full if goes_on else 0.0
            assert counts == pytest.approx([full, during, full], abs=2), module


def test_a_unit_with_its_sensor_and_its_actuator_notices_nothing(local_mission: Any, beside: Any) -> None:
    units = arranged([UnitOrder(name="robot", frequency_hz=RATE_HZ, modules=list(ORDERS.values()))], {})
    lived(local_mission, beside, units)
    times = [at_s for at_s, _value in DONE]
    gaps = [later - earlier for earlier, later in pairwise(times)]
    assert len(DONE) == pytest.approx(9.0 * RATE_HZ / 2, abs=2)
    assert gaps == pytest.approx([2 / RATE_HZ] * len(gaps))
