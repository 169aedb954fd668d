"""Run times: the best run times for detecting, through a shared frequency, a target that is in view for a limited time.

Pure. If the first glimpse of a target extends the slice, the slice needs only its blind begin and a few frames for a
glimpse. It detects a target that is in view for ``view_s``, unless the target leaves before ``blind_s + detect_s`` of
the slice or comes after its end. With N ARCs of equal priority that each run for ``run_s`` and settle for
``settling_s``, the share of phases in which one of the slices of one robot detects it is ``(view_s + run_s - blind_s -
detect_s) / (N (run_s + settling_s))``. It falls with ``run_s`` if and only if ``view_s > settling_s + blind_s +
detect_s``: then slices should be as short as a glimpse allows, otherwise as long as the mission allows.

Short run times are drawn at random for each slice. If all ARCs requested fixed times, the schedule would be periodic,
and a target that passes at a multiple of the period would be seen every time or never.

Source: RAM 2002, "Experiments" (its stated next step: behaviors that compute the run times that they request); the
formula: chosen, for slices in turn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from random import Random

from backbone.ranges import A_DAY_S

GLIMPSE_FRAMES = (2, 4)  # chosen: two frames probably, four certainly include a good one; longer slices come less often
EXTENSION = 1.5  # chosen: multiples of the detection time, because a burst of bad frames delays many detections
GRAIN_S = 0.001  # chosen: finer times are meaningless


@dataclass(frozen=True, slots=True)
class RunTimes:
    """The run times to request.

    Attributes:
        shortest_s: Least useful time, seconds.
        longest_s: Longest useful time without a glimpse; at least the shortest.
        maximum_s: End of extensions.
    """

    shortest_s: float
    longest_s: float
    maximum_s: float

    def drawn_s(self, dice: Random) -> float:
        """Return the next minimum run time to request, seconds; a random number is drawn only for a range."""
        if self.shortest_s == self.longest_s:
            return self.shortest_s
        return _whole_grains(dice.uniform(self.shortest_s, self.longest_s))


def useful_run_times(
    *, view_s: float, settling_s: float, blind_s: float, frame_s: float, detect_s: float, given_s: float
) -> RunTimes:
    """Return the run times to request.

    Args:
        view_s: Shortest time for which a target is in view, seconds.
        settling_s: Time from a switch to the first picture, seconds.
        blind_s: Time from the first picture to the first usable picture, seconds.
        frame_s: Mean time between usable pictures, seconds.
        detect_s: Time from the first picture with the target to certainty, seconds, above 0.
        given_s: Run time in the mission file; only extensions are longer.

    Example:
        >>> useful_run_times(view_s=4.0, settling_s=0.3, blind_s=0.5, frame_s=0.1, detect_s=0.8, given_s=5.0)
        RunTimes(shortest_s=0.7, longest_s=0.9, maximum_s=2.1)
        >>> useful_run_times(view_s=1.5, settling_s=0.3, blind_s=0.5, frame_s=0.1, detect_s=0.8, given_s=5.0)
        RunTimes(shortest_s=5.0, longest_s=5.0, maximum_s=6.2)

    Raises:
        ValueError: A time is negative or not finite, or ``frame_s``, ``detect_s`` or ``given_s`` is 0.
    """
    times = (view_s, settling_s, blind_s, frame_s, detect_s, given_s)
    if not all(math.isfinite(time) and time >= 0 for time in times) or not (frame_s and detect_s and given_s):
        raise ValueError(
            f"no run times from {times} s of view, settling, blindness, one picture, detection and the mission's own"
        )
    short_pays = view_s > settling_s + blind_s + detect_s
    least, most = (blind_s + frames * frame_s if short_pays else given_s for frames in GLIMPSE_FRAMES)
    longest_s = min(given_s, most)
    maximum_s = max(longest_s, min(A_DAY_S, longest_s + EXTENSION * detect_s))  # no ARC accepts a longer one
    return RunTimes(*map(_whole_grains, (min(given_s, least), longest_s, maximum_s)))


def _whole_grains(time_s: float) -> float:
    return max(GRAIN_S, round(round(time_s / GRAIN_S) * GRAIN_S, 9))
