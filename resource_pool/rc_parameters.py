"""Parameters of every RC and of every robot, and the options of its driver among them."""

from __future__ import annotations

import functools
from typing import Annotated, Any

import msgspec

from backbone.component.launch import Launch

KINDS_KEPT = 64  # chosen: more than the kinds of RCs in one process


class RcParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Parameters of every RC; derive and add the parameters of the kind.

    Attributes:
        driver: Name of the driver, or ``package.module:Class``.
        sharable: True if several ARCs may hold it.
        capacity: Share of its time that can be granted, 0 to 1.
        links: Resources with which it can be combined: kind → names.
        world: Simulated world that stands in for the hardware; only for simulated drivers.
        options: Options of the driver: all parameters of the mission file that are not the RC's own. The driver's
            ``options_type`` checks them.
    """

    driver: str = "simulated"
    sharable: bool = False
    capacity: Annotated[float, msgspec.Meta(ge=0, le=1)] = 1.0
    links: dict[str, list[str]] = {}
    world: str = "world"
    options: dict[str, Any] = {}


class RobotParameters(RcParameters, frozen=True, kw_only=True):
    """Parameters of a robot.

    Attributes:
        network_id: Its address on the command radio, 1 to 254.
        protocol: Name of the driver that encodes its packets; empty: the name in ``driver``.
        battery_alarm_share: Battery charge below which an alarm is raised, 0 to 0.9; 0: no alarm.
    """

    network_id: int
    protocol: str = ""
    battery_alarm_share: Annotated[float, msgspec.Meta(ge=0, le=0.9)] = 0.2


def sort_out_options(launch: Launch, parameters_type: type[msgspec.Struct]) -> Launch:
    """Return the launch, with every parameter that is not the RC's own moved into the driver's options."""
    own = _names(parameters_type)
    given = launch.parameters
    options = {name: value for name, value in given.items() if name not in own}
    if not options:
        return launch
    rest = {name: value for name, value in given.items() if name in own}
    rest["options"] = {**rest.get("options", {}), **options}
    return msgspec.structs.replace(launch, parameters=rest)


@functools.lru_cache(maxsize=KINDS_KEPT)
def _names(parameters_type: type[msgspec.Struct]) -> frozenset[str]:
    return frozenset(field.encode_name for field in msgspec.structs.fields(parameters_type))
