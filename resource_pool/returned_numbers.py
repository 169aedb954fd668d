"""Numbers that the code of a driver or of an RC returns; it may return anything. Pure."""

from __future__ import annotations

import math
from collections.abc import Callable

from backbone.ranges import LONGEST_MENTION, MOST_FEW, MOST_MEASURE
from resource_pool.drivers.interface import HardwareFault


def number_of(returned: object) -> float:
    """Return it as a number, infinite if it is too large.

    Raises:
        TypeError: It is no number.
        ValueError: It is an array of several numbers, or a text.
    """
    if isinstance(returned, str | bytes):
        raise ValueError(f"{returned!r:.80} is a text")
    try:
        return float(returned)  # type: ignore[arg-type]  # which finds out whether it is a number
    except OverflowError:
        return math.inf


def number_between(least: float, most: float, returned: object, fault: str) -> float:
    """Return the number of a driver if it is from ``least`` to ``most``.

    Args:
        fault: Sentence for people about another value, with ``{}`` in its place.

    Raises:
        HardwareFault: It is no such number.
    """
    try:
        number = number_of(returned)
    except (TypeError, ValueError):
        number = math.nan
    if not least <= number <= most:
        raise HardwareFault(fault.format(f"{returned!r:.80}"))
    return number


def as_declared(protocol: type, method: str, returned: object) -> object:
    """Return what this method of a robot's protocol returned.

    Raises:
        HardwareFault: The method declares bytes or a number, and it returned something else.
    """
    declared = getattr(getattr(protocol, method, None), "__annotations__", {}).get("return")
    if declared in (bytes, "bytes") and not isinstance(returned, bytes | bytearray | memoryview):
        raise HardwareFault(f"{method} of the robot's protocol returns {type(returned).__name__}, no bytes")
    if declared in (float, "float"):
        fault = f"{method} of the robot's protocol returns {{}}, no finite number"
        return number_between(-MOST_MEASURE, MOST_MEASURE, returned, fault)
    return returned


def applied_values(given: object, what: str, method: Callable[..., object]) -> dict[str, float]:
    """Return the values that a method of an RC returned, without numbers that are not finite, as for reports.

    Args:
        what: Word of the command.

    Raises:
        TypeError: They are not numbers by name, or no message carries so many, or such long names.
    """
    try:
        numbers = {_name(name): number_of(value) for name, value in dict(given).items()}  # type: ignore[call-overload]
    except (TypeError, ValueError):
        numbers = None
    if numbers is None or len(numbers) > MOST_FEW:
        wanted = "return the applied values, each name with a number"
        raise TypeError(f"{method.__module__}:{method.__qualname__} returned {given!r:.80} for {what}; {wanted}")
    return {name: number for name, number in numbers.items() if abs(number) <= MOST_MEASURE}  # not nan, see ranges


def _name(name: object) -> str:
    if not isinstance(name, str) or len(name) > LONGEST_MENTION:
        raise TypeError(f"{name!r:.80} is no name")
    return name
