"""The carrier: a larger robot that brings Scouts in and sets them down; pure functions of time.

The carrier drives its path once (and back with ``there_and_back``). It stops at the point nearest to each place that it
serves. There its arm lifts the Scouts of this place off the deck, one after the other, and lowers them to the floor.
Until a Scout stands on the floor, its pose is that at which the carrier holds it.

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
_LIFT_SHARE = 0.25  # chosen: of the time; the same share to lower the Scout, the rest to reach out


@dataclass(frozen=True, slots=True)
class CarriedPose:
    """Pose of a carried Scout.

    Attributes:
        x_m: Position of its axle's middle.
        y_m: Position.
        z_m: Above the floor.
        heading_rad: Direction of its camera.
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
    """One carrier and its passengers: their poses at any time.

    Args:
        target: Of shape ``carrier``.
        places: Places where its passengers are set down, in the order of the mission file.
    """

    def __init__(self, target: Target, places: list[RobotPlace]) -> None:
        self._target, self._route = target, Route(target)
        leg_s = path_length_m(target.path) / target.speed_m_s
        # One millimetre into a further lap would put the carrier back at the beginning.
        self._last_s = (2 * leg_s + target.rest_s if target.there_and_back else leg_s) - 1e-9
        served = sorted(
            ((_nearest(target, place)[1], place) for place in places), key=lambda stop: (stop[0], stop[1].name)
        )
        self._stops = {place.name: _Stop(at_m, place, slot) for slot, (at_m, place) in enumerate(served)}
        self.passengers = list(self._stops)
        """Names of the carried Scouts, in the order in which the carrier sets them down."""

    def set_down_s(self, passenger: str) -> float:
        """Return the world time from which this passenger stands on the floor and is free."""
        stop = self._stops[passenger]
        return self._target.begin_s + stop.at_m / self._target.speed_m_s + (stop.slot + 1) * SET_DOWN_S

    def pose(self, time_s: float) -> TargetState:
        """Return the carrier's pose at this world time."""
        begin_s = self._target.begin_s
        return self._route.where(begin_s + min(self._driven_s(time_s - begin_s), self._last_s))

    def held(self, passenger: str, time_s: float) -> CarriedPose | None:
        """Return the pose of this passenger at this world time; None once it is set down."""
        free_s = self.set_down_s(passenger)
        if time_s >= free_s:
            return None
        stop, carrier = self._stops[passenger], self.pose(time_s)
        aboard = _aboard(carrier, stop.slot)
        share = (time_s - (free_s - SET_DOWN_S)) / SET_DOWN_S
        return aboard if share <= 0 else _between(aboard, stop.place, share)

    def _driven_s(self, elapsed_s: float) -> float:
        """Return the driving time: the time since departure minus the stops."""
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
    """Check that every carried robot has a carrier with a free slot that can reach the robot's place.

    Raises:
        InvalidWorld: A robot has no such carrier; the first such robot is named.
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
    """Return a place's distance from the path, and the way along the path to the nearest point, in metres."""
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
    """Return the place of a slot on the deck: rows of two; the Scouts that leave first are in the rear."""
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
    """Return the pose of a Scout in the arm after this share, 0 to 1, of the setting-down time."""
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
