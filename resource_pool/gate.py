"""The gate of an ARC: commands pass only during a grant.

Pure: the RC manager's orders go in; whether commands pass, and under which epochs, comes out.

States: shut → ``prepare`` → preparing → ``open`` → open → ``close`` → shut. ``close`` also ends a preparation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from resource_pool.messages import SwappedOut


@dataclass(slots=True)
class Gate:
    """State of the gate.

    Attributes:
        epochs: RC → epoch of the preparing or open connection; empty while shut.
        is_open: True while commands of the decision process pass.
        granted_s: Mission time of the opening; negative while not open.
        reason: Why it is shut.
        by: The ARC or operator that caused it.
        expected_s: Mission time of the next expected slot; negative: unknown.
    """

    arc: str
    epochs: Mapping[str, int] = field(default_factory=dict)
    is_open: bool = False
    granted_s: float = -1.0
    reason: str = "waiting"
    by: str = ""
    expected_s: float = -1.0

    def prepare(self, epochs: Mapping[str, int]) -> None:
        """Record the epochs of a new connection; commands do not pass yet."""
        self.epochs, self.is_open, self.granted_s = dict(epochs), False, -1.0

    def open(self, epochs: Mapping[str, int], now_s: float) -> bool:
        """Open the gate, unless another connection or a close came meanwhile; return whether it is open."""
        if self.epochs != epochs:
            return False
        self.is_open, self.granted_s, self.reason, self.by, self.expected_s = True, now_s, "", "", -1.0
        return True

    def close(self, reason: str, by: str, expected_s: float) -> bool:
        """Close the gate; return whether it was open or preparing."""
        was_in_use = bool(self.epochs)
        self.epochs, self.is_open, self.granted_s = {}, False, -1.0
        self.reason, self.by, self.expected_s = reason, by, expected_s
        return was_in_use

    def epoch_of(self, rc: str) -> int:
        """Return the epoch for commands to the RC.

        Raises:
            SwappedOut: The gate is shut.
        """
        if not self.is_open:
            because = f" because of {self.by}" if self.by else ""
            raise SwappedOut(
                f"{self.arc} holds nothing now; the last reason: {self.reason}{because}",  # others may have come since
                reason=self.reason,
                by=self.by,
                expected_start_s=self.expected_s,
            )
        return self.epochs[rc]
