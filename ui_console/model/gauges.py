"""Gauges: a robot's reports as texts, positions in ranges, and flags. Pure.

Names and units come from the names of the reports' fields. Ranges and meanings come from their declaration, once it is
known.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import get_args

import msgspec

from backbone import ranges
from backbone.component.abilities import FieldForm, unit_of
from backbone.spoken import three_digits
from resource_pool.arc_client import Readings
from ui_console.model.applied import words_of
from ui_console.model.fields import has_range

SHARE = "_share"
BATTERY = "battery_share"
LOW_BATTERY = 0.2  # as the robots' RCs, ``RobotParameters.battery_alarm_share``
OF_THE_BUS = frozenset(
    (limits.ge, limits.le)
    for kind in (ranges.Meters, ranges.Radians, ranges.Speed, ranges.TurnRate, ranges.WheelSpeed, ranges.Measure)
    for limits in get_args(kind)[1:]
)
"""Generic ranges that only reject impossible numbers; a position in such a range has no meaning for people."""


class GaugeView(msgspec.Struct, frozen=True):
    """A value that a robot reports.

    Attributes:
        name: For people.
        text: The value with its unit; for a flag, ``on`` or ``off``.
        share: Position of the value in its range, 0 (least) to 1 (most); negative: no range.
        is_share: True: the value itself is a share, such as a battery's charge.
        flag: The value of a flag; None: not a flag.
        span: Its range with its unit; empty: no range.
        doc: Its meaning; empty: not known.
    """

    name: str
    text: str
    share: float = -1.0
    is_share: bool = False
    flag: bool | None = None
    span: str = ""
    doc: str = ""


def gauges(readings: Readings, reports: Sequence[FieldForm] = ()) -> list[GaugeView]:
    """Return a gauge for each value, shares first, in the order of the report.

    Args:
        reports: Their known declarations.

    Example:
        >>> values = {"tilt_rad": 0.5, "battery_share": 0.871, "up": True}
        >>> [gauge.text for gauge in gauges(Readings("r", 1.0, values))]
        ['87 %', '0.5 rad', 'on']
    """
    declared = {form.name: form for form in reports}
    found = (_gauge(name, value, declared.get(name)) for name, value in readings.values.items())
    return sorted(found, key=lambda one: not one.is_share)


def battery_of(readings: Readings) -> float | None:
    """Return the charge of the battery, 0 to 1; None: the robot does not report it."""
    share = readings.values.get(BATTERY)
    return None if share is None else float(share)


def _gauge(name: str, value: float | bool, form: FieldForm | None) -> GaugeView:
    doc = form.doc if form is not None else ""
    if isinstance(value, bool):
        return GaugeView(words_of(name), "on" if value else "off", flag=value, doc=doc)
    if name.endswith(SHARE):
        share = min(1.0, max(0.0, value))
        return GaugeView(words_of(name.removesuffix(SHARE)), f"{100 * value:.0f} %", share, is_share=True, doc=doc)
    unit = unit_of(name)
    unit = f" {unit}" if unit else ""
    text = f"{three_digits(value)}{unit}"
    if form is None or not has_range(form) or form.most <= form.least or (form.least, form.most) in OF_THE_BUS:
        return GaugeView(words_of(name), text, doc=doc)
    place = min(1.0, max(0.0, (value - form.least) / (form.most - form.least)))
    span = f"{three_digits(form.least)} to {three_digits(form.most)}{unit}"
    return GaugeView(words_of(name), text, place, span=span, doc=doc)
