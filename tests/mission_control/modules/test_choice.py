"""Two algorithms side by side: one is the source of a key, another can be chosen while the unit runs."""

from __future__ import annotations

from typing import Any

import pytest
from sample_modules import Number, Sum
from test_unit_component import NUMBERS, TESTER, UnitComponent, listen, play

from backbone.bus.clock import VirtualClock
from backbone.bus.interface import Bus
from backbone.component.messages import Parameters, SetParameter, WrongParameter
from backbone.keys import Conversation
from backbone.mission.arranged import UnitsQuestion
from mission_control.modules.arrangement import UnitOrder, arranged, judged
from mission_control.modules.choice import ChoiceOrder
from mission_control.modules.graph import GraphRefused
from mission_control.modules.module import Module
from mission_control.modules.orders import ModuleOrder

DOUBLE = ModuleOrder("double", "sample_modules:Doubler", outputs={"twice": "by-two"})
FOURFOLD = ModuleOrder("fourfold", "sample_modules:Doubler", {}, {"number": "by-two"}, {"twice": "by-four"})
SUMMING = ModuleOrder("summing", "sample_modules:Summing")
CHOICE = ChoiceOrder("twice", "by-two", ["by-four"])


class Listing(Module):
    class Outputs(Module.Outputs):
        numbers: list[int]

    def update(self, inputs: Any) -> Outputs:
        return self.Outputs([])


class Numbering(Module):
    class Outputs(Module.Outputs):
        number: Number

    def update(self, inputs: Any) -> Outputs:
        return self.Outputs(Number(1))


@pytest.mark.parametrize("is_apart", [False, True])
def test_another_algorithm_is_chosen_while_both_run(local_mission: Any, beside: Any, is_apart: bool) -> None:
    async def scene(bus: Bus, started: dict[str, UnitComponent]) -> None:
        sums: list[Sum] = []
        both: list[Number] = []
        listen(bus, "mission_control/*/sum", Sum, sums)
        for key in ("by-two", "by-four"):
            listen(bus, f"mission_control/{min(started)}/{key}", Number, both)

        async def send(*values: float) -> None:
            for value in values:
                bus.publish(TESTER, Conversation.EVENTS, Number(value))
                await VirtualClock().sleep_s(0.01)

        async def choose(chosen: dict[str, str]) -> None:
            order = SetParameter("chosen", chosen)
            await bus.ask(f"mission_control/{max(started)}", order, Parameters, within_s=1.0)

        await send(1, 10)
        await choose({"twice": "by-four"})
        await send(1, 10)
        await choose({})
        await send(1, 10)
        assert [one.value for one in sums] == [22, 66, 88]
        assert [one.value for one in both[:2]] == [2, 4]
        with pytest.raises(WrongParameter, match="cannot choose nothing as twice") as refused:
            await choose({"twice": "nothing"})
        assert refused.value.remedy == "Choose twice from by-two or by-four."

    units = [UnitOrder(name="all", modules=[DOUBLE, FOURFOLD, SUMMING], choices=[CHOICE])]
    if is_apart:
        units = [
            UnitOrder(name="first", modules=[DOUBLE, FOURFOLD]),
            UnitOrder(name="rest", modules=[SUMMING], choices=[CHOICE]),
        ]
    play(local_mission, beside, arranged(units, NUMBERS), scene)


@pytest.mark.parametrize(
    ("choices", "says"),
    [
        ([ChoiceOrder("twice", "by-twoo")], r"no module produces it \(did you mean 'by-two'\?\)"),
        ([ChoiceOrder("by-two", "by-four")], "choose-by-two produces by-two, and so does double"),
        ([ChoiceOrder("twice", "by-two", ["sum"])], "choose-twice takes sample_modules:Number as sum"),
        ([ChoiceOrder("twice", "numbers")], r"list\[int\] is no class"),
    ],
)
def test_a_choice_that_cannot_be_is_refused(choices: list[ChoiceOrder], says: str) -> None:
    listing = ModuleOrder("listing", f"{__name__}:Listing")
    unit = UnitOrder(name="one", modules=[DOUBLE, FOURFOLD, SUMMING, listing], choices=choices)
    with pytest.raises(GraphRefused, match=says):
        arranged([unit], NUMBERS)


def test_a_unit_that_only_chooses_between_its_own_keys_is_named_if_it_never_runs() -> None:
    listings = [
        {"name": name, "class_path": f"{__name__}:Numbering", "outputs": {"number": name}} for name in ("one", "two")
    ]
    unit = {"name": "still", "modules": listings, "choices": [{"key": "number", "source": "one", "others": ["two"]}]}
    [fault] = judged(UnitsQuestion("", ({"name": "runs", "frequency_hz": 1.0, "modules": []}, unit), {})).faults
    assert (fault.unit, fault.remedy) == ("still", 'Write frequency-hz="…"')
