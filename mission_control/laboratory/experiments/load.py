"""Load experiment: the detection rate over the number of robots on one channel, as in IROS 2001's conclusion.

Source: IROS 2001, "Conclusions": one channel is of no use beyond about 8 or 9 robots. S107.
"""

from __future__ import annotations

from collections.abc import Sequence

from mission_control.laboratory.experiments.conditions import Condition, Policy

FEWEST, MOST = 2, 10


def load_conditions(policy: Policy = "paper", channels: int = 1, driven: float = 1.0) -> Sequence[Condition]:
    """Return a condition for each number of robots: two watch, the others are held by consoles."""
    return tuple(
        Condition(extra=robots - FEWEST, policy=policy, channels=channels, driven=driven)
        for robots in range(FEWEST, MOST + 1)
    )
