"""Six modules in any arrangement: replayed into it, one recording gives the same outputs, to the byte."""

from __future__ import annotations

import io
from collections import defaultdict
from collections.abc import Mapping
from contextlib import AsyncExitStack
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from recorded_approach import AT, EXAMPLES, KEY, KEYS, MODULES, WATCH, arrangements, drawn, with_arrangement
from small_recordings import CLASSES

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.launch import Launch
from backbone.keys import Conversation
from backbone.mission.reader import read_mission
from backbone.naming import Subsystem
from backbone.recording.player import Player
from backbone.recording.reader import Recording
from backbone.recording.revival import message_as_sent
from backbone.wire import Message
from mission_control.modules.arrangement import GivenKey, UnitOrder, arranged
from mission_control.modules.orders import ModuleOrder, Source, UnitParameters
from mission_control.modules.run import connected
from mission_control.modules.unit_component import UnitComponent

PICTURES = {"picture": GivenKey("mission_control.messages:GreyPicture", Source(AT))}
CLASS_NAMES = (
    "PictureAverage",
    "PictureDifference",
    "RegionFinder",
    "RegionVote",
    "GrowthEstimator",
    "ApproachAlarm",
)
ORDERS = {name: ModuleOrder(name, f"approach:{kind}") for name, kind in zip(MODULES, CLASS_NAMES, strict=True)}
FRAMES = 60


@pytest.fixture(autouse=True)
def _the_example_can_be_imported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(EXAMPLES)


@cache
def recording() -> bytes:
    return drawn(FRAMES).getvalue()


def opened() -> Recording:
    return Recording(io.BytesIO(recording()))


@cache
def said_by_hand() -> dict[str, bytes]:
    """Return key → all values that the modules make of the recording, one after the other in this process."""
    made: dict[str, list[Any]] = defaultdict(list)
    units = connected(*(ORDERS[name].load() for name in MODULES), given={"picture": PICTURES["picture"].type})
    for key in KEYS:
        units.listen(key, made[key].append)
    for message in opened().messages((KEY,)):
        units.feed("picture", message_as_sent(CLASSES, message), message.at_s)
    return {key: msgspec.msgpack.encode(values) for key, values in made.items()}


def said_on_the_bus(local_mission: Any, beside: Any, units: Mapping[str, UnitParameters]) -> dict[str, bytes]:
    """Return key → all values that the units publish when the recording is replayed."""
    heard: dict[str, list[Message]] = defaultdict(list)

    async def main() -> None:
        clock = VirtualClock()
        async with AsyncExitStack() as stack:
            network = await stack.enter_async_context(local_mission())
            for name, one in units.items():
                await stack.enter_async_context(beside(component(network, name, one)))
            bus = network.join(WATCH, clock)
            stack.push_async_callback(bus.close)
            for key in KEYS:
                bus.subscribe(f"mission_control/*/{key}", Conversation.OUTPUTS, Message, listener(heard[key]))
            player = Player(bus, clock, opened(), CLASSES, since_s=clock.now_s(), keys=(KEY,))
            player.catch_up()
            await player.run()
            await clock.sleep_s(1.0)
            assert player.played == FRAMES

    run_virtual(main())
    return {key: msgspec.msgpack.encode(values) for key, values in heard.items() if values}


def listener(into: list[Message]) -> Any:
    return lambda envelope: into.append(envelope.body)


def component(network: Any, name: str, parameters: UnitParameters) -> UnitComponent:
    given_, clock = msgspec.to_builtins(parameters), VirtualClock()
    launch = Launch(
        network.mission, Subsystem.MISSION_CONTROL, name, "execution_unit", "", "local", "", 0.0, 1.0, given_
    )
    return UnitComponent(launch, network.join(launch.address, clock), clock)


def check(local_mission: Any, beside: Any, units: Mapping[str, UnitParameters]) -> None:
    said = said_on_the_bus(local_mission, beside, units)
    assert said.keys() == {key for one in units.values() for key in one.published}
    assert "alarm" in said
    for key, values in said.items():
        assert values == said_by_hand()[key], key


@settings(max_examples=share(100))
@given(
    places=st.lists(st.integers(0, 5), min_size=6, max_size=6),
    order=st.permutations(MODULES),
    threads=st.lists(st.booleans(), min_size=6, max_size=6),
)
def test_any_arrangement_says_of_a_recording_what_the_modules_say_by_hand(
    local_mission: Any, beside: Any, places: list[int], order: list[str], threads: list[bool]
) -> None:
    inside: dict[int, list[ModuleOrder]] = defaultdict(list)
    for name in order:
        inside[places[MODULES.index(name)]].append(ORDERS[name])
    orders = [UnitOrder(name=f"u{n}", modules=of, own_thread=threads[n]) for n, of in inside.items()]
    check(local_mission, beside, arranged(orders, PICTURES))


@pytest.mark.processes
@pytest.mark.parametrize("modules", arrangements().values(), ids=arrangements())
def test_the_arrangements_of_the_guide_say_what_the_modules_say_by_hand(
    modules: str, tmp_path: Path, local_mission: Any, beside: Any
) -> None:
    file = tmp_path / "approach.xml"
    file.write_text(with_arrangement(modules))
    units = {one.name: msgspec.convert(one.parameters, UnitParameters) for one in read_mission(file).units}
    assert sorted(one.name for of in units.values() for one in of.modules) == sorted(MODULES)
    check(local_mission, beside, units)


def test_the_example_sees_that_somebody_comes() -> None:
    import approach

    alarms = msgspec.msgpack.decode(said_by_hand()["alarm"], type=list[approach.Alarm])
    assert [alarms[0].is_on, alarms[-1].is_on] == [False, True]
