"""Which run times are worth asking for, to see what is in view for a while through a shared frequency.

Pure. While something is in view for ``view_s``, a slice sees it that overlaps this time by ``detect_s`` after its
first ``blind_s``. With N equals that each run for ``run_s`` and settle for ``settling_s``, the share of phases in
which one of the slices of one robot does is ``(view_s + run_s - blind_s - 2 detect_s) / (N (run_s + settling_s))``.
It falls with ``run_s`` if and only if ``view_s > settling_s + blind_s + 2 detect_s``: then slices should be as short
as still tell something, otherwise they should be as long as the mission allows.

Source: RAM 2002, "Experiments" (behaviors that work out the run times they ask for are its stated next step); the
formula: chosen, for slices in turn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

GRAIN_S = 0.25  # chosen: times of views are guesses, and run times that hardly differ make schedules nobody can read


@dataclass(frozen=True, slots=True)
class RunTimes:
    """What to ask for.

    Attributes:
        minimum_s: Shortest useful time, seconds.
        maximum_s: End of extensions, at least the minimum.
    """

    minimum_s: float
    maximum_s: float


def useful_run_times(*, view_s: float, settling_s: float, blind_s: float, detect_s: float, given_s: float) -> RunTimes:
    """Return the run times to ask for.

    A short slice holds the blind beginning and about one time to detect: it is as short as still tells something of
    what is in view already. It can be extended by one more time to detect, when something was glimpsed at its end.

    Args:
        view_s: Shortest time for which what is looked for is in view, seconds.
        settling_s: Time from a switch to the first picture, seconds.
        blind_s: Time from the first picture to the first that tells something, seconds.
        detect_s: Time from the first picture with it to certainty, seconds, above 0.
        given_s: Run time the mission gives; no longer one is asked for, but for extensions.

    Example:
        >>> useful_run_times(view_s=4.0, settling_s=0.3, blind_s=0.5, detect_s=0.8, given_s=5.0)
        RunTimes(minimum_s=1.25, maximum_s=2.25)
        >>> useful_run_times(view_s=2.0, settling_s=0.3, blind_s=0.5, detect_s=0.8, given_s=5.0)
        RunTimes(minimum_s=5.0, maximum_s=6.0)

    Raises:
        ValueError: A time is negative or not finite, or ``detect_s`` or ``given_s`` is 0.
    """
    times = (view_s, settling_s, blind_s, detect_s, given_s)
    if not all(math.isfinite(time) and time >= 0 for time in times) or not detect_s or not given_s:
        raise ValueError(f"no run times from {times} s of view, settling, blindness, detection and the mission's own")
    short_pays = view_s > settling_s + blind_s + 2 * detect_s
    minimum_s = min(given_s, max(GRAIN_S, _near(blind_s + detect_s))) if short_pays else given_s
    return RunTimes(minimum_s, _up(minimum_s + detect_s))


def _near(time_s: float) -> float:
    """Return the time in whole grains, rounded."""
    return round(round(time_s / GRAIN_S) * GRAIN_S, 9)


def _up(time_s: float) -> float:
    """Return the time in whole grains, rounded up."""
    return round(math.ceil(time_s / GRAIN_S - 1e-9) * GRAIN_S, 9)
