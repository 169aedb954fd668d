"""Applied values of a command in one line, for people. Pure."""

from __future__ import annotations

from collections.abc import Mapping

from backbone.component.abilities import UNITS, unit_of

AS_SPEED = {"rad/s": "+.1f", "m/s": "+.2f"}  # chosen: a tenth of a wheel turn, a centimeter; signs are directions
SLICE_TOLD_S = 1.0  # chosen: a remaining time below a second is not shown


def command_line(word: str, values: Mapping[str, float]) -> str:
    """Return a command with its applied values.

    Example:
        >>> command_line("shine", {"brightness": 0.5}), command_line("jump", {})
        ('shine brightness 0.5', 'jump')
    """
    return f"{word.replace('_', ' ')} {values_line(values)}".strip()


def values_line(values: Mapping[str, float]) -> str:
    """Return applied values as text; a unit that all values have appears once.

    Example:
        >>> values_line({"left_rad_s": 4.0, "right_rad_s": -4.0})
        'left +4.0, right -4.0 rad/s'
        >>> values_line({"forward_m_s": 0.1, "turn_rad_s": 0.0})
        'forward +0.10 m/s, turn +0.0 rad/s'
    """
    units = [unit_of(name) for name in values]
    if len(set(units)) > 1:
        return ", ".join(f"{_value(name, value)} {unit_of(name)}".strip() for name, value in values.items())
    together = ", ".join(_value(name, value) for name, value in values.items())
    return f"{together} {units[0]}".strip() if units else together


def _value(name: str, value: float) -> str:
    unit = unit_of(name)
    return f"{words_of(name)} {value:{AS_SPEED.get(unit, '.3g')}}"


def words_of(name: str) -> str:
    """Return a field's name for people, without its unit.

    Example:
        >>> words_of("turn_rad_s"), words_of("brightness")
        ('turn', 'brightness')
    """
    suffix = next((one for one in UNITS if name.endswith(f"_{one}")), "")
    return (name.removesuffix(f"_{suffix}") if suffix else name).replace("_", " ")


def slice_end_line(until_s: float, now_s: float) -> str:
    """Return the remaining seconds of a slice, for people; empty: the slice has no end, or ends now."""
    left_s = until_s - now_s
    if until_s < 0 or abs(left_s) < SLICE_TOLD_S:
        return ""
    return f", slice {left_s:.0f} s" if left_s > 0 else ", beyond its slice"
