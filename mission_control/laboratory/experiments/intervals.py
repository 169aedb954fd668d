"""Confidence of a counted rate: Wilson's interval and standard errors. Pure."""

from __future__ import annotations

import math

Z95 = 1.959963984540054  # the normal distribution's 97.5 % point


def wilson(detected: int, trials: int) -> tuple[float, float]:
    """Return Wilson's score interval of the true rate, at 95 %.

    Source: E. B. Wilson, "Probable inference, the law of succession, and statistical inference", 1927.

    Args:
        detected: Successes, 0 to ``trials``.
        trials: Above 0.

    Raises:
        ValueError: The numbers are not a count of successes.

    Example:
        >>> [round(bound, 2) for bound in wilson(16, 20)]
        [0.58, 0.92]
    """
    if not 0 <= detected <= trials or not trials:
        raise ValueError(f"{detected} of {trials} is no rate")
    rate, square = detected / trials, Z95 * Z95
    middle = (rate + square / (2 * trials)) / (1 + square / trials)
    half = Z95 / (1 + square / trials) * math.sqrt(rate * (1 - rate) / trials + square / (4 * trials**2))
    return max(0.0, middle - half), min(1.0, middle + half)


def standard_errors_apart(detected: int, trials: int, predicted: float) -> float:
    """Return the distance of a counted rate from a predicted one, in standard errors.

    The standard error is that of the predicted rate, but at least that of half a success, so that a single deviation
    from a prediction of 0 or 1 does not count as disagreement.

    Example:
        >>> round(standard_errors_apart(60, 100, 0.5), 6)
        2.0
    """
    rate = min(1 - 0.5 / trials, max(0.5 / trials, predicted))
    return (detected / trials - predicted) / math.sqrt(rate * (1 - rate) / trials)
