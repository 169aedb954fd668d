"""Numbers and values as people write them. Pure."""

from __future__ import annotations

import json
from typing import Any

LARGE = 999.5  # from here on, three significant digits are written with an exponent
HUGE = 1e9  # chosen: a longer number is not read at a glance


def counted(number: int, noun: str) -> str:
    """Return number and noun, in the singular for 1.

    Example:
        >>> counted(1, "component"), counted(2, "component"), counted(0, "alarm")
        ('1 component', '2 components', '0 alarms')
    """
    return f"{number} {noun}{'' if number == 1 else 's'}"


def three_digits(number: float) -> str:
    """Return a number with three significant digits, and a larger one in full.

    Example:
        >>> three_digits(7.1428), three_digits(4000.0), three_digits(12345.6), three_digits(999.7), three_digits(1e20)
        ('7.14', '4000', '12346', '1000', '1e+20')
    """
    return f"{number:.0f}" if LARGE <= abs(number) < HUGE else f"{number:.3g}"


def value_text(value: object) -> str:
    """Return a value of a parameter as a person types it, rounded to a readable number of digits.

    Example:
        >>> value_text(50.83098785400034), value_text([1, 0.1 + 0.2]), value_text("base"), value_text(None)
        ('50.831', '[1, 0.3]', '"base"', 'null')
    """
    return json.dumps(_rounded(value), ensure_ascii=False, default=str)


def _rounded(value: object) -> Any:
    match value:
        case float():
            return float(f"{value:.6g}")
        case list() | tuple():
            return [_rounded(each) for each in value]
        case dict():
            return {name: _rounded(each) for name, each in value.items()}
    return value
