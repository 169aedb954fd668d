"""A carrier brings Scouts in and sets them down where and when the description says."""

import math

import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st

from scout_model import dimensions, radio_link
from scout_model.carrier import CarrierTrip
from scout_model.description import RobotPlace, Target, WorldDescription
from scout_model.errors import InvalidWorld
from scout_model.world import World

CARRIER = Target("carrier", "carrier", [(0.5, 3.0), (6.5, 3.0)], 0.5, begin_s=1.0, rest_s=2.0, there_and_back=True)
FIRST = RobotPlace("scout1", 1, 2.5, 3.6, math.pi / 2, carried_by="carrier")
SECOND = RobotPlace("scout2", 2, 4.5, 2.3, -math.pi / 2, carried_by="carrier")
THIRD = RobotPlace("scout3", 3, 4.5, 3.8, 0.0, carried_by="carrier")
PASSENGERS = [SECOND, FIRST, THIRD]
STEP_S = 1 / dimensions.FRAMES_PER_S


def world(*places: RobotPlace, carrier: Target = CARRIER) -> World:
    return World(WorldDescription(9.0, 6.0, robots=list(places), targets=[carrier]))


def wait_until(room: World, time_s: float) -> None:
    while room.time_s < time_s:
        room.step_frame()


def test_it_sets_them_down_along_its_way_each_after_the_time_the_arm_takes() -> None:
    trip = CarrierTrip(CARRIER, PASSENGERS)
    assert trip.passengers == ["scout1", "scout2", "scout3"]
    arm_s = dimensions.SET_DOWN_S
    assert [trip.set_down_s(name) for name in trip.passengers] == [5.0 + arm_s, 9.0 + 2 * arm_s, 9.0 + 3 * arm_s]


def test_it_rests_while_its_arm_works_and_then_drives_on_to_the_end_and_back() -> None:
    trip = CarrierTrip(CARRIER, PASSENGERS)
    along_m = [trip.pose(time_s).x_m for time_s in (0.0, 1.0, 5.0, 6.5, 8.0, 12.0, 17.9, 18.0, 22.0, 24.0, 36.0, 99.0)]
    assert along_m == pytest.approx([0.5, 0.5, 2.5, 2.5, 2.5, 4.5, 4.5, 4.5, 6.5, 6.5, 0.5, 0.5], abs=1e-6)


def test_without_a_way_back_it_stays_at_the_end() -> None:
    there = Target("carrier", "carrier", [(0.5, 3.0), (6.5, 3.0)], 0.5, there_and_back=False)
    assert CarrierTrip(there, []).pose(500.0).x_m == pytest.approx(6.5)


@given(st.floats(0.0, 30.0), st.floats(0.0, 0.1))
def test_nothing_it_holds_ever_jumps(time_s: float, later_s: float) -> None:
    trip = CarrierTrip(CARRIER, PASSENGERS)
    for passenger in trip.passengers:
        here, there = trip.held(passenger, time_s), trip.held(passenger, time_s + later_s)
        if here is not None and there is not None:
            moved_m = math.dist((here.x_m, here.y_m, here.z_m), (there.x_m, there.y_m, there.z_m))
            assert moved_m <= 1.5 * later_s + 1e-6


def test_they_ride_on_its_deck_and_stand_at_their_places_afterwards() -> None:
    room = world(*PASSENGERS)
    wait_until(room, 4.0)
    for passenger in ("scout1", "scout2", "scout3"):
        x_m, y_m, z_m = room.position_m(passenger)
        assert room.is_carried(passenger)
        assert math.dist((x_m, y_m), room.pose("carrier")[:2]) < 0.3
        assert z_m == pytest.approx(dimensions.CARRIER_DECK_M + dimensions.WHEEL_RADIUS_M)
    wait_until(room, 5.0 + dimensions.SET_DOWN_S + 2 * STEP_S)
    assert [room.is_carried(name) for name in ("scout1", "scout2", "scout3")] == [False, True, True]
    wait_until(room, 22.0)
    for place in PASSENGERS:
        x_m, y_m, heading_rad = room.pose(place.name)
        assert (x_m, y_m) == pytest.approx((place.x_m, place.y_m), abs=2e-3)
        assert math.remainder(heading_rad - place.heading_rad, 2 * math.pi) == pytest.approx(0.0, abs=0.01)
        assert room.is_asleep(place.name)


def test_who_was_set_down_obeys_and_who_is_carried_goes_nowhere() -> None:
    room = world(*PASSENGERS)
    wait_until(room, 10.0)
    for frame in range(60):
        if frame % 5 == 0:
            room.hear(1, radio_link.encode_drive(10.0, 10.0))
            room.hear(2, radio_link.encode_drive(10.0, 10.0))
        room.strike("scout3", (1.0, 1.0, 1.0), (5.0, 0.0, 0.0))
        room.step_frame()
    assert room.position_m("scout1")[1] > FIRST.y_m + 0.3
    assert room.is_carried("scout2")
    wait_until(room, 22.0)
    assert room.pose("scout2")[:2] == pytest.approx((SECOND.x_m, SECOND.y_m), abs=2e-3)


@settings(max_examples=share(5))
@given(st.floats(0.2, 1.0), st.floats(0.0, 3.0))
def test_place_and_time_do_not_depend_on_how_fast_it_comes(speed_m_s: float, begin_s: float) -> None:
    carrier = Target("carrier", "carrier", [(1.5, 3.0), (3.5, 3.0)], speed_m_s, begin_s=begin_s)
    room = world(FIRST, carrier=carrier)
    set_down_s = CarrierTrip(carrier, [FIRST]).set_down_s("scout1")
    assert set_down_s == pytest.approx(begin_s + 1.0 / speed_m_s + dimensions.SET_DOWN_S)
    wait_until(room, set_down_s - 2 * STEP_S)
    assert room.is_carried("scout1")
    wait_until(room, set_down_s + 2 * STEP_S)
    assert not room.is_carried("scout1")
    assert room.pose("scout1")[:2] == pytest.approx((FIRST.x_m, FIRST.y_m), abs=2e-3)


@pytest.mark.parametrize(
    ("places", "told"),
    [
        ([RobotPlace("a", 1, 2.5, 3.6, 0.0, carried_by="bus")], "no carrier"),
        ([RobotPlace("a", 1, 2.5, 3.1, 0.0, carried_by="carrier")], "0.10 m beside the path"),
        ([RobotPlace("a", 1, 2.5, 5.1, 0.0, carried_by="carrier")], "2.10 m beside the path"),
        ([RobotPlace(f"s{n}", n, 2.5, 3.6, 0.0, carried_by="carrier") for n in range(1, 9)], "places"),
    ],
)
def test_what_no_carrier_can_set_down_is_refused(places: list[RobotPlace], told: str) -> None:
    with pytest.raises(InvalidWorld, match=told):
        world(*places)
