"""A battery: what is drawn is gone, and no more than that."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scout_model.battery import Battery, Consumption

shares = st.floats(0.0, 1.0)
capacities = st.floats(1e-3, 1e9)
powers = st.floats(0.0, 1e4)
pauses = st.floats(0.0, 1e5)


@given(capacities, shares, st.lists(st.tuples(powers, pauses), max_size=20))
def test_while_power_is_drawn_the_charge_never_grows_and_stays_a_share(
    capacity_j: float, share: float, drawn: list[tuple[float, float]]
) -> None:
    battery, now_s = Battery(capacity_j, share), 0.0
    before = battery.share(now_s)
    for power_w, pause_s in drawn:
        battery.draw(power_w, now_s)
        for _ in range(3):
            now = battery.share(now_s)
            assert 0.0 <= now <= before
            assert not battery.is_empty(now_s) or now == 0.0
            before = now
            now_s += pause_s


@given(capacities, shares, st.lists(st.tuples(st.floats(-1e4, 1e4), pauses), max_size=20))
def test_charged_or_drained_it_is_never_below_nothing_or_above_full(
    capacity_j: float, share: float, drawn: list[tuple[float, float]]
) -> None:
    battery, now_s = Battery(capacity_j, share), 0.0
    for power_w, pause_s in drawn:
        battery.draw(power_w, now_s)
        now_s += pause_s
        assert 0.0 <= battery.share(now_s) <= 1.0


@given(capacities, st.floats(1e-3, 1e4))
def test_it_lasts_as_long_as_its_energy_does_and_stays_empty(capacity_j: float, power_w: float) -> None:
    battery, lasts_s = Battery(capacity_j), capacity_j / power_w
    battery.draw(power_w, 0.0)
    assert battery.share(lasts_s / 2) == pytest.approx(0.5)
    assert not battery.is_empty(lasts_s * (1 - 1e-9))
    assert battery.is_empty(lasts_s * (1 + 1e-9))
    battery.draw(0.0, lasts_s * 2)
    assert battery.is_empty(lasts_s * 3)
    battery.draw(-power_w, lasts_s * 3)
    assert battery.share(lasts_s * 3.5) == pytest.approx(0.5)
    assert not battery.is_empty(lasts_s * 3.5)


def test_what_nothing_is_drawn_from_stays_as_it_is() -> None:
    battery = Battery(100.0, 0.25)
    assert battery.share(1e9) == 0.25
    assert Battery(100.0, 0.0).is_empty(0.0)


@given(st.floats(0, 100), st.floats(0, 100), st.floats(0, 100), shares)
def test_load_and_transmitter_cost_on_top_of_idling(
    idle: float, transmitter: float, motors: float, load: float
) -> None:
    consumption = Consumption(idle, transmitter, motors)
    assert consumption.power_w(0.0, is_transmitting=False) == idle
    assert consumption.power_w(load, is_transmitting=True) == pytest.approx(idle + transmitter + motors * load)


@pytest.mark.parametrize(("capacity_j", "share"), [(0.0, 1.0), (-1.0, 1.0), (math.inf, 1.0), (1.0, 1.1), (1.0, -0.1)])
def test_no_battery_is_made_of_nonsense(capacity_j: float, share: float) -> None:
    with pytest.raises(ValueError, match="a battery of"):
        Battery(capacity_j, share)


def test_no_power_is_none() -> None:
    with pytest.raises(ValueError, match="nan"):
        Battery(1.0).draw(math.nan, 0.0)
