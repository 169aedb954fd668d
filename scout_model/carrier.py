"""The carrier: a bigger robot that brings Scouts in and sets them down; pure functions of time.

It drives its path once (and back with ``there_and_back``), stops where each place it serves is nearest, and there
an arm lifts the Scouts of this place off its deck, one after the other, and lowers them to the floor.
Until a Scout stands on the floor it goes wherever the carrier holds it.

Source: IROS 2001, section 5: Scouts are deployed into the environment by a human or another robot.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

from scout_model.description import RobotPlace, Target, WorldDescription
from scout_model.dimensions import (
    CARRIER_DECK_M,
    CARRIER_LENGTH_M,
    CARRIER_PLACES,
    CARRIER_WIDTH_M,
    FARTHEST_SET_DOWN_M,
    NEAREST_SET_DOWN_M,
    SET_DOWN_S,
    WHEEL_RADIUS_M,
)
from scout_model.errors import InvalidWorld
from scout_model.targets import CARRIER, Route, TargetState, path_length_m

_LIFT_M = 0.05  # chosen: clears the neighbor on the deck
_LIFT_SHARE = 0.25  # chosen: of the time; as much to lower it, the rest to reach out


@dataclass(frozen=True, slots=True)
class CarriedPose:
    """Place of a carried Scout.

    Attributes:
        x_m: Position of its axle's middle.
        y_m: Position.
        z_m: Above the floor.
        heading_rad: Where its camera looks.
    """

    x_m: float
    y_m: float
    z_m: float
    heading_rad: float


@dataclass(frozen=True, slots=True)
class _Stop:
    at_m: float
    place: RobotPlace
    slot: int


class CarrierTrip:
    """One carrier, what it carries, and where both are at any time.

    Args:
        target: Of shape ``carrier``.
        places: Where its passengers are to be set down, in the order of the mission file.
    """

    def __init__(self, target: Target, places: list[RobotPlace]) -> None:
        self._target, self._route = target, Route(target)
        leg_s = path_length_m(target.path) / target.speed_m_s
        # The first millimetre of a further lap would lead it back.
        self._last_s = (2 * leg_s + target.rest_s if target.there_and_back else leg_s) - 1e-9
        served = sorted(
            ((_nearest(target, place)[1], place) for place in places), key=lambda stop: (stop[0], stop[1].name)
        )
        self._stops = {place.name: _Stop(at_m, place, slot) for slot, (at_m, place) in enumerate(served)}
        self.passengers = list(self._stops)
        """Names of those it carries, in the order in which it sets them down."""

    def set_down_s(self, passenger: str) -> float:
        """Return the world time at which this passenger stands on the floor and is free."""
        stop = self._stops[passenger]
        return self._target.begin_s + stop.at_m / self._target.speed_m_s + (stop.slot + 1) * SET_DOWN_S

    def pose(self, time_s: float) -> TargetState:
        """Return where the carrier is at this world time."""
        begin_s = self._target.begin_s
        return self._route.where(begin_s + min(self._driven_s(time_s - begin_s), self._last_s))

    def held(self, passenger: str, time_s: float) -> CarriedPose | None:
        """Return where the carrier holds this passenger at this world time; None once it is set down."""
        free_s = self.set_down_s(passenger)
        if time_s >= free_s:
            return None
        stop, carrier = self._stops[passenger], self.pose(time_s)
        aboard = _aboard(carrier, stop.slot)
        share = (time_s - (free_s - SET_DOWN_S)) / SET_DOWN_S
        return aboard if share <= 0 else _between(aboard, stop.place, share)

    def _driven_s(self, elapsed_s: float) -> float:
        """Return how long it has been driving: the time since its departure without its stops."""
        driven_s = max(0.0, elapsed_s)
        for stop in self._stops.values():
            arrives_s = stop.at_m / self._target.speed_m_s
            if driven_s <= arrives_s:
                break
            driven_s = max(arrives_s, driven_s - SET_DOWN_S)
        return driven_s


def trips(description: WorldDescription) -> dict[str, CarrierTrip]:
    """Return the trip of each carrier, by its name."""
    return {
        target.name: CarrierTrip(target, [place for place in description.robots if place.carried_by == target.name])
        for target in description.targets
        if target.shape == CARRIER
    }


def check_stops(description: WorldDescription) -> None:
    """Return if every carried robot has a carrier with a free place that can reach where it is set down.

    Raises:
        InvalidWorld: The first that has not.
    """
    carriers = {target.name: target for target in description.targets if target.shape == CARRIER}
    aboard = dict.fromkeys(carriers, 0)
    for place in description.robots:
        if not place.carried_by:
            continue
        carrier = carriers.get(place.carried_by)
        if carrier is None:
            raise InvalidWorld(f"{place.name} is carried by {place.carried_by!r}, which is no carrier")
        aboard[carrier.name] += 1
        if aboard[carrier.name] > CARRIER_PLACES:
            raise InvalidWorld(f"{carrier.name} has {CARRIER_PLACES} places, too few for {place.name}")
        distance_m, _ = _nearest(carrier, place)
        if not NEAREST_SET_DOWN_M <= distance_m <= FARTHEST_SET_DOWN_M:
            raise InvalidWorld(
                f"{place.name} is to be set down {distance_m:.2f} m beside the path of {carrier.name}, "
                f"whose arm reaches from {NEAREST_SET_DOWN_M} to {FARTHEST_SET_DOWN_M} m"
            )


def _nearest(target: Target, place: RobotPlace) -> tuple[float, float]:
    """Return how far a place is from the path, and how far along the path that is, metres."""
    best, behind_m = (math.inf, 0.0), 0.0
    for (ax, ay), (bx, by) in pairwise(target.path):
        length_m = math.dist((ax, ay), (bx, by))
        if length_m == 0:
            continue
        ux, uy = (bx - ax) / length_m, (by - ay) / length_m
        along_m = min(length_m, max(0.0, (place.x_m - ax) * ux + (place.y_m - ay) * uy))
        distance_m = math.dist((place.x_m, place.y_m), (ax + along_m * ux, ay + along_m * uy))
        best = min(best, (distance_m, behind_m + along_m))
        behind_m += length_m
    return best


def _aboard(carrier: TargetState, slot: int) -> CarriedPose:
    """Return the place of a slot on the deck: rows of two, the first to leave stand in the rear."""
    row, side = divmod(slot, 2)
    rows = CARRIER_PLACES // 2
    along_m = (row - (rows - 1) / 2) * CARRIER_LENGTH_M / rows
    across_m = (side - 0.5) * CARRIER_WIDTH_M / 2
    cos, sin = math.cos(carrier.heading_rad), math.sin(carrier.heading_rad)
    return CarriedPose(
        carrier.x_m + along_m * cos - across_m * sin,
        carrier.y_m + along_m * sin + across_m * cos,
        CARRIER_DECK_M + WHEEL_RADIUS_M,
        carrier.heading_rad,
    )


def _between(aboard: CarriedPose, place: RobotPlace, share: float) -> CarriedPose:
    """Return where the arm holds a Scout after this share, 0 to 1, of the time it takes to set it down."""
    reach = min(1.0, max(0.0, (share - _LIFT_SHARE) / (1 - 2 * _LIFT_SHARE)))
    top_m = aboard.z_m + _LIFT_M
    if share <= _LIFT_SHARE:
        z_m = aboard.z_m + _LIFT_M * share / _LIFT_SHARE
    else:
        lowered = max(0.0, (share - (1 - _LIFT_SHARE)) / _LIFT_SHARE)
        z_m = top_m + lowered * (WHEEL_RADIUS_M - top_m)
    turn_rad = math.remainder(place.heading_rad - aboard.heading_rad, 2 * math.pi)
    return CarriedPose(
        aboard.x_m + reach * (place.x_m - aboard.x_m),
        aboard.y_m + reach * (place.y_m - aboard.y_m),
        z_m,
        aboard.heading_rad + reach * turn_rad,
    )
