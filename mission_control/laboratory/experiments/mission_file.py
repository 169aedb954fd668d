"""The mission file of a condition: a trial runs an ordinary, checked mission."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from xml.sax.saxutils import quoteattr

import msgspec

from backbone.mission.model import MissionDescription
from backbone.mission.reader import read_mission_bytes
from mission_control.laboratory.experiments.conditions import Condition
from mission_control.laboratory.experiments.geometry import (
    EXTRAS,
    FRAME_RATE_HZ,
    PATH,
    ROOM_M,
    SETTLING_S,
    WATCHERS,
    shortest_view_s,
)

MISSION_PRIORITY = 10
"""Priority of the mission and of the consoles that hold the extra Scouts, which are equals."""
WORLD = "world"
FOR_EVER_S = 3600.0  # chosen: longer than any trial; the target passes once
PERIOD_S, PACKET_TIME_S = 0.1, 0.002  # mission.xml: ten packets a second of two milliseconds


def watcher_of(robot: str) -> str:
    """Return the name of the behavior that watches through this Scout."""
    return f"watch-{robot}"


def mission_text(condition: Condition) -> str:
    """Return the mission file of this condition. Its target never departs; each trial sets the departure."""
    return "\n".join(_lines(condition)) + "\n"


@lru_cache(maxsize=64)
def mission_of(condition: Condition) -> MissionDescription:
    """Return the checked mission of this condition."""
    return read_mission_bytes(mission_text(condition).encode(), "surveillance.xml")


def mission_of_trial(condition: Condition, world_seed: int, departs_s: float) -> MissionDescription:
    """Return the mission of one trial.

    Args:
        world_seed: Seed of all random processes of world and air.
        departs_s: World time at which the target departs.
    """
    mission = mission_of(condition)
    (world,) = mission.components
    content = dict(world.parameters[WORLD])
    content["seed"] = world_seed
    content["targets"] = [{**target, "begin_s": departs_s} for target in content["targets"]]
    there = msgspec.structs.replace(world, parameters={**world.parameters, WORLD: content})
    return msgspec.structs.replace(mission, components=(there,))


def _lines(condition: Condition) -> Iterator[str]:
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield f"<!-- {condition.title()}, policy {condition.policy}. -->"
    yield f'<mission name="surveillance" priority="{MISSION_PRIORITY}">'
    if condition.policy == "adaptive":
        yield '  <core><service type="rc_manager"><parameter name="discipline" value="time"/></service></core>'
    yield "  <resources>"
    yield from _resources(condition)
    yield "  </resources>"
    yield from _world(condition)
    yield "  <behaviors>"
    for robot, place in zip(condition.watching, WATCHERS, strict=False):
        yield from _watcher(condition, robot, shortest_view_s(condition.passage, place))
    yield "  </behaviors>"
    yield "</mission>"


def _resources(condition: Condition) -> Iterator[str]:
    yield '    <resource type="command_radio" name="radio" sharable="true" capacity="1.0" driver="simulated"/>'
    for channel in range(1, condition.channels + 1):
        yield (
            f'    <resource type="video_frequency" name="video{channel}" connect-s="{SETTLING_S}" driver="simulated"/>'
        )
        yield f'    <resource type="framegrabber" name="grabber{channel}" driver="simulated">'
        yield f'      <uses type="video_frequency" name="video{channel}"/>'
        yield f'      <parameter name="frame_rate_hz" value="{FRAME_RATE_HZ:g}"/>'
        yield "    </resource>"
    for number, robot in enumerate(condition.robots, start=1):
        yield f'    <resource type="scout" name="{robot}" features="camera" driver="simulated">'
        yield '      <uses type="command_radio" name="radio"/>'
        for channel in range(1, condition.channels + 1):
            yield f'      <uses type="video_frequency" name="video{channel}"/>'
        yield f'      <parameter name="network_id" value="{number}"/>'
        yield "    </resource>"


def _world(condition: Condition) -> Iterator[str]:
    passage = condition.passage
    yield f'  <world name="{WORLD}" type="simulated_world" host="base" seed="1">'
    yield f'    <room width-m="{ROOM_M[0]:g}" depth-m="{ROOM_M[1]:g}"/>'
    yield f'    <air noise="{_decimal(condition.noise)}"/>'
    places = (*WATCHERS[: condition.active], *EXTRAS[: condition.extra])
    for robot, (x_m, y_m) in zip(condition.robots, places, strict=True):
        yield f'    <robot name="{robot}" x-m="{x_m:g}" y-m="{y_m:g}" heading-deg="90"/>'
    target: dict[str, object] = {
        "name": "target",
        "shape": passage.shape,
        "speed-m-s": _decimal(passage.speed_m_s),
        "begin-s": f"{FOR_EVER_S:g}",
        "there-and-back": str(passage.there_and_back).lower(),
    }
    if not passage.there_and_back:
        target["rest-s"] = f"{FOR_EVER_S:g}"
    yield f"    {_tag('target', target, closed=False)}"
    for x_m, y_m in PATH:
        yield f'      <point x-m="{x_m:g}" y-m="{y_m:g}"/>'
    yield "    </target>"
    yield "  </world>"


def _watcher(condition: Condition, robot: str, view_s: float) -> Iterator[str]:
    yield f'    <behavior type="watch_for_motion" name="{watcher_of(robot)}" priority="1">'
    yield (
        f'      <arc kind="capture" minimum-runtime-s="{_decimal(condition.slice_s)}" period-s="{PERIOD_S}" '
        f'packet-time-s="{PACKET_TIME_S}">'
    )
    yield f'        <wish type="scout" name="{robot}"/>'
    yield "      </arc>"
    yield f'      <parameter name="frames_wanted" value="{condition.frames_wanted}"/>'
    if condition.policy == "adaptive":
        yield f'      <parameter name="view_s" value="{view_s:.2f}"/>'
        yield f'      <parameter name="settling_s" value="{SETTLING_S}"/>'
        yield f'      <parameter name="frame_rate_hz" value="{FRAME_RATE_HZ}"/>'
    yield "    </behavior>"


def _decimal(number: float) -> str:
    """Return the number as mission files write it: without an exponent."""
    return f"{number:.9f}".rstrip("0").rstrip(".")


def _tag(name: str, attributes: dict[str, object], *, closed: bool = True) -> str:
    written = "".join(f" {attribute}={quoteattr(str(value))}" for attribute, value in attributes.items())
    return f"<{name}{written}{'/' if closed else ''}>"
