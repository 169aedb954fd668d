"""A battery: its capacity, and its charge while a robot draws power.

Rules:

* The power is constant between two calls of ``Battery.draw``, so the charge at any moment is exact.
* The charge stays between 0 and the capacity. While power is drawn, it never grows.
* The charge depends only on world time: the same draws at the same times leave the same charge.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Consumption:
    """Power that a robot draws from its battery, in watts.

    Attributes:
        idle_w: Constant part: processor, receiver, sensors.
        transmitter_w: Additional while its video transmitter is on.
        motors_w: Additional at full load of its motors.
    """

    idle_w: float
    transmitter_w: float
    motors_w: float

    def power_w(self, load: float, *, is_transmitting: bool) -> float:
        """Return the total power; ``load`` is the load of the motors, 0 to 1.

        Example:
            >>> Consumption(1.0, 2.0, 4.0).power_w(0.5, is_transmitting=True)
            5.0
        """
        return self.idle_w + self.motors_w * load + (self.transmitter_w if is_transmitting else 0.0)


class Battery:
    """A battery from which no power has been drawn yet.

    Raises:
        ValueError: The capacity is not positive and finite, or the share is not between 0 and 1.
    """

    def __init__(self, capacity_j: float, share: float = 1.0) -> None:
        if not (0.0 < capacity_j < math.inf and 0.0 <= share <= 1.0):
            raise ValueError(f"a battery of {capacity_j} J, charged to {share}")
        self.capacity_j = capacity_j
        """Energy of the full battery."""
        self._charge_j = capacity_j * share
        self._power_w = 0.0
        self._since_s = 0.0
        self._empty_s = math.inf if share > 0.0 else 0.0

    def draw(self, power_w: float, now_s: float) -> None:
        """Draw this power from now on; a negative power charges.

        Args:
            power_w: Total power; it replaces the power of the last call.
            now_s: World time, never before an earlier call's.

        Raises:
            ValueError: The power is not finite.
        """
        if power_w == self._power_w:
            return
        if not math.isfinite(power_w):
            raise ValueError(f"a power of {power_w} W")
        self._charge_j = self._left_j(now_s)
        self._power_w, self._since_s = power_w, now_s
        if self._charge_j <= 0.0 <= power_w:
            self._empty_s = now_s
        else:
            self._empty_s = now_s + self._charge_j / power_w if power_w > 0.0 else math.inf

    def share(self, now_s: float) -> float:
        """Return the charge as a share of the capacity, 0 to 1."""
        return self._left_j(now_s) / self.capacity_j

    def is_empty(self, now_s: float) -> bool:
        """Return whether the charge is 0."""
        return now_s >= self._empty_s

    def _left_j(self, now_s: float) -> float:
        if now_s >= self._empty_s:
            return 0.0
        left_j = self._charge_j - self._power_w * (now_s - self._since_s)
        return min(self.capacity_j, max(0.0, left_j))
