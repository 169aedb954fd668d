"""Damping: an owner that repeatedly requests and withdraws cannot keep others from running.

A higher request preempts others at once (rule 4). If such a request is withdrawn before its grant, it has cost the
others their turn and gained nothing. After a few of these in a row, the owner's next request counts only after a wait,
which doubles with each further one.

Rule of this file: pure; time is an argument.
"""

from __future__ import annotations

FREE = 4  # chosen: an operator may change their mind so often
MOST = 9  # chosen: from this number on the wait does not grow
FORGIVEN_S = 2.0  # chosen: one withdrawal is forgotten after this time
LONGEST_S = 30.0  # chosen: some slices of the preempted ARCs


class Damping:
    """Counts withdrawals before the grant, owner by owner."""

    def __init__(self) -> None:
        self._left: dict[str, tuple[float, float]] = {}

    def left_in_vain(self, owner: str, now_s: float) -> None:
        """Count a request of this owner that cut a slice short and was withdrawn before its grant."""
        count = min(MOST, self._count(owner, now_s) + 1)
        self._left = {one: left for one, left in self._left.items() if self._count(one, now_s) > 0}
        self._left[owner] = count, now_s

    def wait_s(self, owner: str, now_s: float) -> float:
        """Return how long the next request of this owner must wait before it counts, seconds; 0 as a rule.

        Example:
            >>> damping = Damping()
            >>> for _ in range(FREE + 3):
            ...     damping.left_in_vain("ui_console/anna", 0.0)
            >>> [damping.wait_s("ui_console/anna", now_s) for now_s in (0.0, 2.0, 4.0, 8.0)]
            [8.0, 4.0, 2.0, 0.0]
        """
        count = self._count(owner, now_s)
        if count <= 0:
            self._left.pop(owner, None)
        return 0.0 if count < FREE else min(LONGEST_S, 2.0 ** (count - FREE))

    def _count(self, owner: str, now_s: float) -> float:
        count, at_s = self._left.get(owner, (0.0, now_s))
        return max(0.0, count - (now_s - at_s) / FORGIVEN_S)
