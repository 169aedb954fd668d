"""A unit on the bus: rounds by frequency and by input, three arrangements, statistics, debug views."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Sequence
from typing import Any

import msgspec
import pytest
from sample_modules import Number
from units_on_the_bus import ARRANGEMENTS, MODULES, NUMBERS, TESTER, listen, orders, play, unit_on

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.component.messages import (
    AskStatistics,
    ComponentState,
    SetParameter,
    Statistics,
    WrongParameter,
)
from backbone.debug_views import ListViews, Views
from backbone.exchange import UnknownModule
from backbone.keys import Conversation
from backbone.module_waits import AskModule, AwaitedInput, ModuleWaits
from backbone.quality import QUALITY, OutputQuality, Urgency
from backbone.wire import MAX_LARGE_MESSAGE_BYTES, WIRE_VERSION, Envelope, Message, OversizedMessage, write
from mission_control.modules.arrangement import UnitOrder, arranged
from mission_control.modules.execution_unit import NeverRuns
from mission_control.modules.graph import GraphRefused
from mission_control.modules.module import Module
from mission_control.modules.orders import ModuleOrder, UnitParameters, WrongModule, unsendable
from mission_control.modules.unit_component import UnitComponent


def test_the_same_modules_say_the_same_in_every_arrangement_on_the_bus(local_mission: Any, beside: Any) -> None:
    said: list[bytes] = []
    for units, own_thread in itertools.product(ARRANGEMENTS, (False, True)):

        async def scene(bus: Bus, started: dict[str, UnitComponent]) -> None:
            places: list[Number] = []
            listen(bus, "mission_control/*/place", Number, places)
            for value in range(20):
                bus.publish(TESTER, Conversation.EVENTS, Number(value / 7))
                await VirtualClock().sleep_s(0.01)
            assert len(places) == 10
            said.append(msgspec.msgpack.encode(places))

        play(local_mission, beside, arranged(orders(units, own_thread), NUMBERS), scene)
    assert len(set(said)) == 1


def test_only_what_another_unit_or_no_other_module_takes_is_published(local_mission: Any, beside: Any) -> None:
    units = arranged(orders(ARRANGEMENTS[1]), NUMBERS)
    assert {name: (list(one.sources), one.published) for name, one in units.items()} == {
        "first": (["number"], ["twice"]),
        "rest": (["twice"], ["place"]),
    }
    alone = arranged(orders({"one": ["doubler", "summing"]}), NUMBERS)["one"]
    assert alone.published == ["sum"]


def test_between_neighbors_of_one_process_the_message_itself_is_handed_over(local_mission: Any, beside: Any) -> None:
    async def scene(bus: Bus, started: dict[str, UnitComponent]) -> None:
        heard: list[Any] = []
        listen(bus, "mission_control/one/same", Number, heard)
        sent = Number(1.0)
        bus.publish(TESTER, Conversation.EVENTS, sent)
        await VirtualClock().sleep_s(0.01)
        assert heard[0] is sent

    order = UnitOrder(name="one", modules=[ModuleOrder("passing", f"{__name__}:Passing")])
    play(local_mission, beside, arranged([order], NUMBERS), scene)


class Passing(Module):
    class Inputs(Module.Inputs):
        number: Number

    class Outputs(Module.Outputs):
        same: Number

    def update(self, inputs: Inputs) -> Outputs:
        return self.Outputs(inputs.number)


def test_an_output_is_sent_in_its_quality(local_mission: Any, beside: Any) -> None:
    async def scene(bus: Bus, started: dict[str, UnitComponent]) -> None:
        sender = started["first"].bus
        assert isinstance(sender, LocalBus)
        assert sender.quality("mission_control/first/twice", Conversation.OUTPUTS) == urgent["twice"]
        assert sender.quality("mission_control/first/else", Conversation.OUTPUTS) == QUALITY[Conversation.OUTPUTS]

    urgent = {"twice": OutputQuality(urgency=Urgency.URGENT, reliable=True).quality}
    play(local_mission, beside, arranged(orders(ARRANGEMENTS[1]), NUMBERS, urgent), scene)


@pytest.mark.parametrize("own_thread", [False, True])
def test_a_frequency_is_kept_and_counted(local_mission: Any, beside: Any, own_thread: bool) -> None:
    async def scene(bus: Bus, started: dict[str, UnitComponent]) -> None:
        heard: list[Any] = []
        listen(bus, "mission_control/one/number", Number, heard)
        await VirtualClock().sleep_s(2.0)
        told = (await bus.ask("mission_control/one", AskStatistics(), Statistics, within_s=1.0)).values
        assert told["missed"] == 0
        assert told["rate_hz"] == pytest.approx(20.0)
        assert told["rounds"] == told["ticks"] == told["counter_runs"] == pytest.approx(40, abs=1)
        assert len(heard) == pytest.approx(40, abs=1)
        assert (heard[1].value - heard[0].value) == 3.0

    counter = ModuleOrder("counter", "sample_modules:Counter", {"step": 3.0})
    order = UnitOrder(name="one", frequency_hz=20.0, modules=[counter], own_thread=own_thread)
    play(local_mission, beside, arranged([order], {}), scene)


@pytest.mark.parametrize("own_thread", [False, True])
def test_a_module_that_waits_names_the_inputs_that_it_waits_for(
    local_mission: Any, beside: Any, own_thread: bool
) -> None:
    async def scene(bus: Bus, _started: dict[str, UnitComponent]) -> None:
        async def waits(module: str) -> tuple[int, list[AwaitedInput]]:
            told = await bus.ask("mission_control/all", AskModule(module), ModuleWaits, within_s=1.0)
            return told.runs, told.awaited

        assert await waits("doubler") == (0, [AwaitedInput("number", TESTER, has_come=False, is_late=False)])
        assert await waits("summing") == (0, [AwaitedInput("twice", "doubler", has_come=False, is_late=False)])
        bus.publish(TESTER, Conversation.EVENTS, Number(1.0))
        await VirtualClock().sleep_s(1.0)
        assert await waits("doubler") == (1, [AwaitedInput("number", TESTER, has_come=True, is_late=False)])
        assert await waits("follower") == (0, [AwaitedInput("sum", "summing", has_come=False, is_late=False)])
        with pytest.raises(UnknownModule, match="all has no module 'nobody'"):
            await waits("nobody")

    play(local_mission, beside, arranged(orders(ARRANGEMENTS[0], own_thread), NUMBERS), scene)


def test_misses_are_named_in_status_and_statistics(local_mission: Any, beside: Any) -> None:
    async def scene(bus: Bus, started: dict[str, UnitComponent]) -> None:
        states: list[ComponentState] = []
        bus.subscribe("mission_control/one", Conversation.STATUS, ComponentState, lambda e: states.append(e.body))
        for value in range(5):  # between two rounds of the unit
            bus.publish(TESTER, Conversation.EVENTS, Number(value))
            await VirtualClock().sleep_s(0.01)
        await VirtualClock().sleep_s(1.0)
        told = (await bus.ask("mission_control/one", AskStatistics(), Statistics, within_s=1.0)).values
        assert told["overwritten_number"] == 4
        assert states[-1].feedback == "4 values of number came too early"

    order = msgspec.convert(
        {"name": "one", "frequency_hz": 2.0, "on_input": "none", "modules": [msgspec.to_builtins(MODULES["doubler"])]},
        UnitOrder,
    )
    play(local_mission, beside, arranged([order], NUMBERS), scene)


def test_the_debug_views_of_modules_are_those_of_the_unit(local_mission: Any, beside: Any) -> None:
    async def scene(bus: Bus, started: dict[str, UnitComponent]) -> None:
        bus.publish(TESTER, Conversation.EVENTS, Number(1.0))
        await VirtualClock().sleep_s(0.01)
        listed = await bus.ask("mission_control/all", ListViews(), Views, within_s=1.0)
        assert [(one.view, one.value) for one in listed.views] == [("doubler-factor", 2.0)]

    play(local_mission, beside, arranged(orders(ARRANGEMENTS[0]), NUMBERS), scene)


def test_a_running_unit_keeps_its_modules(local_mission: Any, beside: Any) -> None:
    async def scene(bus: Bus, started: dict[str, UnitComponent]) -> None:
        with pytest.raises(WrongParameter, match="started with"):
            await bus.ask("mission_control/all", SetParameter("frequency_hz", 3.0), Message, within_s=1.0)

    play(local_mission, beside, arranged(orders(ARRANGEMENTS[0]), NUMBERS), scene)


class Plain(Module):
    class Outputs(Module.Outputs):
        thing: int

    def update(self, inputs: Module.Inputs) -> Outputs:
        return self.Outputs(1)


def unit(*modules: ModuleOrder, published: Sequence[str] = (), frequency_hz: float = 1.0) -> UnitParameters:
    return UnitParameters(frequency_hz=frequency_hz, modules=list(modules), published=list(published))


@pytest.mark.parametrize(
    ("parameters", "refusal", "says"),
    [
        (
            unit(ModuleOrder("plain", f"{__name__}:Plain"), published=["thing"]),
            WrongModule,
            "builtins:int is no message",
        ),
        (unit(ModuleOrder("plain", f"{__name__}:Plain"), published=["other"]), WrongModule, "no module produces it"),
        (unit(ModuleOrder("gone", "sample_modules:Gone")), WrongModule, "Gone"),
        (unit(ModuleOrder("number", "sample_modules:Number")), WrongModule, "is no module"),
        (unit(ModuleOrder("counter", "sample_modules:Counter", {"stp": 1})), WrongModule, "counter .* `stp`"),
        (unit(ModuleOrder("doubler", "sample_modules:Doubler")), GraphRefused, "doubler needs number"),
        (unit(ModuleOrder("counter", "sample_modules:Counter"), frequency_hz=0.0), NeverRuns, "no frequency"),
    ],
)
def test_what_a_unit_cannot_run_is_refused_with_the_reason(
    parameters: UnitParameters, refusal: type[Exception], says: str
) -> None:
    async def main() -> None:
        await asyncio.sleep(0)
        with pytest.raises(refusal, match=says):
            unit_on(LocalNetwork(), "one", parameters)

    run_virtual(main())


@pytest.mark.parametrize(
    ("most", "remedy"),
    [
        (4096, 'Declare <quality key="ball" most-bytes="5000"/> or more in the mission file'),
        (MAX_LARGE_MESSAGE_BYTES, OversizedMessage.remedy),  # nothing longer can be declared
    ],
)
def test_a_value_over_its_declared_limit_names_the_attribute_and_a_value(most: int, remedy: str) -> None:
    refused = OversizedMessage("Ball of 5000 bytes", bytes=5000, most_bytes=most)
    told = unsendable("ball, a Ball,", "ball", refused)
    assert told.detail == "ball, a Ball, cannot be sent: Ball of 5000 bytes"
    assert told.remedy.startswith(remedy)


class Gap(Message, frozen=True):
    data: Any


class SendsWhatItIsGiven(Module):
    class Outputs(Module.Outputs):
        gap: Gap

    class Parameters(Module.Parameters, frozen=True):
        of: str

    parameters: Parameters

    def update(self, inputs: Module.Inputs) -> Outputs:
        return self.Outputs(Gap(UNSENDABLE[self.parameters.of]))


UNSENDABLE: dict[str, Any] = {
    "number": 1j,
    "memory": memoryview(bytes(8))[::2],
    "text": "\udc80",
    "length": bytes(2**26 + 1),
}


@pytest.mark.parametrize(
    ("of", "says"),
    [
        ("number", "gap, a Gap, cannot be sent: Encoding objects of type complex"),
        ("memory", "gap, a Gap, cannot be sent: memoryview: underlying buffer is not C-contiguous"),
        ("text", "gap, a Gap, cannot be sent: Gap has a text"),
        ("length", "gap, a Gap, cannot be sent: Gap of 67108"),
    ],
)
def test_an_output_that_cannot_be_sent_is_named(
    local_mission: Any, monkeypatch: pytest.MonkeyPatch, of: str, says: str
) -> None:
    """The local bus hands objects over; here it writes them, as the bus between processes does."""
    order = ModuleOrder("sender", f"{__name__}:SendsWhatItIsGiven", {"of": of})

    def written(address: str, conversation: Conversation, message: Message) -> None:
        write(Envelope(WIRE_VERSION, TESTER, 1, 0.0, "", message))

    async def main() -> None:
        async with local_mission() as network:
            sender = unit_on(network, "one", unit(order, published=["gap"]))
            monkeypatch.setattr(sender.bus, "publish", written)
            with pytest.raises(WrongModule, match=says):
                await sender.run()

    run_virtual(main())
