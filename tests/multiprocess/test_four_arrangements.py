"""One graph of six modules in four arrangements of real processes: a recording gives the same outputs, to the byte."""

from __future__ import annotations

import asyncio
import io
import re
from collections import defaultdict
from collections.abc import Collection, Mapping
from functools import partial
from pathlib import Path
from typing import Any, cast

import msgspec
import pytest
from free_ports import free_port
from recorded_approach import AT, EXAMPLES, KEY, KEYS, arrangements, simulated, with_arrangement
from running_mission import RunningMission, mission_up
from small_recordings import CLASSES

from backbone.bus.interface import Bus
from backbone.component.messages import AskStatistics, Statistics
from backbone.keys import Conversation
from backbone.mission.reader import read_mission_bytes
from backbone.quality import OutputQuality
from backbone.recording.player import Player
from backbone.recording.reader import Recorded, Recording
from backbone.recording.revival import message_as_sent
from backbone.wire import Envelope, Message
from mission_control.modules.orders import ModuleOrder, UnitParameters
from mission_control.modules.ports import kinds_of_ports
from mission_control.modules.run import connected

pytestmark = [pytest.mark.processes, pytest.mark.thorough, pytest.mark.alone, pytest.mark.timeout(180)]

WITHIN_S = 20.0
STEP_WITHIN_S = 8.0  # a busy machine needs a second for a picture
RECORDED_S = 9.0
Outputs = dict[str, bytes]
JsonObject = dict[str, Any]


class OneByOne:
    """Waits before each picture until all outputs for the picture before are there, so that none is left out.

    Args:
        keys: Of the outputs.
    """

    def __init__(self, keys: Collection[str]) -> None:
        self.heard: dict[str, list[Message]] = {key: [] for key in keys}
        self._sent, self._news = 0, asyncio.Event()

    def take(self, key: str, output: Envelope[Message]) -> None:
        self.heard[key].append(output.body)
        self._news.set()

    async def next_step(self, _picture: Recorded | None = None) -> None:
        """Return when each key has an output for each picture that was sent."""
        try:
            async with asyncio.timeout(STEP_WITHIN_S):
                while min(map(len, self.heard.values())) < self._sent:
                    self._news.clear()
                    await self._news.wait()
        except TimeoutError:
            pytest.fail(f"lost: {self._sent} pictures, { ({key: len(values) for key, values in self.heard.items()}) }")
        self._sent += 1


@pytest.fixture(scope="module")
def recording() -> bytes:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(EXAMPLES)
        return simulated(RECORDED_S).getvalue()


@pytest.fixture(autouse=True)
def _the_example_can_be_imported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(EXAMPLES))
    monkeypatch.syspath_prepend(EXAMPLES)


def only_modules(text: str) -> str:
    """Return a mission without robots, whose pictures come from the recording."""
    return re.sub(r"<(resources|world|behaviors)\b.*</\1>", "", text, flags=re.DOTALL)


def reliable(text: str) -> str:
    """Return a mission whose modules' values are never dropped, as repeated ones are where a queue is full."""
    rows = "".join(f'<quality key="{key}" reliable="true"/>' for key in KEYS)
    return text.replace("<modules>", f"<modules>{rows}")


def units_of(text: str) -> dict[str, UnitParameters]:
    units = read_mission_bytes(text.encode(), "approach.xml").units
    return {one.name: msgspec.convert(one.parameters, UnitParameters) for one in units}


def said_by_hand(recording: bytes, orders: list[ModuleOrder]) -> Outputs:
    """Return key → all values that these modules make of the recording, one after the other in this process."""
    modules = [order.load() for order in orders]
    made: dict[str, list[Any]] = defaultdict(list)
    units = connected(*modules, given={"picture": "mission_control.messages:GreyPicture"})
    for key in (port.key for module in modules for port in module.ports().outputs):
        units.listen(key, made[key].append)
    for message in Recording(io.BytesIO(recording)).messages((KEY,)):
        units.feed("picture", message_as_sent(CLASSES, message), message.at_s)
    return {key: msgspec.msgpack.encode(values) for key, values in made.items()}


async def replayed(mission: RunningMission, recording: bytes, units: Mapping[str, UnitParameters]) -> Outputs:
    """Return key → all values that the units publish when the recording is replayed into the mission."""
    one_by_one = OneByOne([key for one in units.values() for key in one.published])
    async with mission.bus(AT) as bus:
        bus.declare_quality(AT, Conversation.OUTPUTS, OutputQuality(reliable=True).quality)
        for name, parameters in units.items():
            kinds = {
                port: kind
                for order in parameters.modules
                for port, kind in kinds_of_ports(order.load().Outputs).items()
            }
            for key in parameters.published:
                at = f"mission_control/{name}/{key}"
                heard = partial(one_by_one.take, key)
                bus.subscribe(at, Conversation.OUTPUTS, cast("type[Message]", kinds[key]), heard, lossless=True)
        await until_heard(bus, units)
        source, clock = Recording(io.BytesIO(recording)), mission.clock
        player = Player(bus, clock, source, CLASSES, since_s=-1.0, keys=(KEY,), next_step=one_by_one.next_step)
        player.catch_up()
        await player.run()
        await one_by_one.next_step()
    return {key: msgspec.msgpack.encode(values) for key, values in one_by_one.heard.items()}


async def until_heard(bus: Bus, units: Mapping[str, UnitParameters]) -> None:
    """Return when pictures of this bus are heard, and all units know that it listens to them."""
    async with asyncio.timeout(WITHIN_S):
        while not bus.is_overheard(Conversation.OUTPUTS):  # noqa: ASYNC110  nobody tells of a listener
            await asyncio.sleep(0.02)
    for name in units:  # what was declared before a question arrives before it
        await bus.ask(f"mission_control/{name}", AskStatistics(), Statistics, within_s=WITHIN_S)


@pytest.mark.parametrize("arrangement", arrangements())
def test_a_recording_replayed_into_each_arrangement_gives_the_same_outputs(
    arrangement: str, recording: bytes, tmp_path: Path
) -> None:
    text = reliable(only_modules(with_arrangement(arrangements()[arrangement], port=free_port())))
    units, file = units_of(text), tmp_path / "approach.xml"
    file.write_text(text)
    with mission_up(mission_xml=file) as mission:
        status, said = mission.status(), asyncio.run(replayed(mission, recording, units))
    there = [one for one in status["components"] if one["name"] in units]
    creators = [one for one in status["components"] if one["type"] == "creator"]
    hosts = 2 if "<hosts>" in text else 1  # each has a creator of its own, on this one machine
    assert len({one["host"] for one in there}) == len({one["pid"] for one in creators}) == hosts
    assert len({one["pid"] for one in there}) == (1 if "process=" in text else len(units))
    orders = [order for one in units.values() for order in one.modules]
    by_hand = said_by_hand(recording, orders)
    assert said.keys() == {key for one in units.values() for key in one.published}
    for key, values in said.items():
        assert values == by_hand[key], key
    import approach

    alarms = msgspec.msgpack.decode(said["alarm"], type=list[approach.Alarm])
    assert any(alarm.is_on for alarm in alarms)
    assert len(alarms) == len([*Recording(io.BytesIO(recording)).messages((KEY,))])
