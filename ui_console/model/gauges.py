"""Gauges: what a robot reports, as words and shares. Pure; units come from the names of the reports' fields."""

from __future__ import annotations

import msgspec

from backbone.component.abilities import unit_of
from resource_pool.arc_client import Readings
from ui_console.model.applied import words_of

SHARE = "_share"
BATTERY = "battery_share"
LOW_BATTERY = 0.2  # as the robots' RCs, ``RobotParameters.battery_alarm_share``


class GaugeView(msgspec.Struct, frozen=True):
    """One value that a robot reports.

    Attributes:
        name: For people.
        text: The value with its unit.
        share: The value as a share, 0 to 1, of its most; negative: it is no share.
    """

    name: str
    text: str
    share: float = -1.0


def gauges(readings: Readings) -> list[GaugeView]:
    """Return a gauge for each value, shares first, in the order of the report.

    Example:
        >>> [gauge.text for gauge in gauges(Readings("r", 1.0, {"tilt_rad": 0.5, "battery_share": 0.871, "up": True}))]
        ['87 %', '0.5 rad', 'yes']
    """
    return sorted((_gauge(name, value) for name, value in readings.values.items()), key=lambda one: one.share < 0)


def battery_of(readings: Readings) -> float | None:
    """Return the charge of the battery, 0 to 1; None: the robot does not report it."""
    share = readings.values.get(BATTERY)
    return None if share is None else float(share)


def _gauge(name: str, value: float | bool) -> GaugeView:
    if isinstance(value, bool):
        return GaugeView(words_of(name), "yes" if value else "no")
    if name.endswith(SHARE):
        return GaugeView(words_of(name.removesuffix(SHARE)), f"{100 * value:.0f} %", min(1.0, max(0.0, value)))
    unit = unit_of(name)
    return GaugeView(words_of(name), f"{value:.3g}{f' {unit}' if unit else ''}")
