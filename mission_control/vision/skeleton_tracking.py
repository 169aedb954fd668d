"""Follow the landmark from picture to picture by the 17 pixels of its skeleton.

Source: RAM 2002, "Visual Servoing" and figure 7.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from mission_control.vision.landmark import Picture, Sighting


class Phase(StrEnum):
    """What the tracker does with pictures."""

    ACQUIRING = "acquiring"
    TRACKING = "tracking"
    SEARCHING = "searching"


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """What one picture said.

    Attributes:
        phase: ``TRACKING``: here it is.  ``SEARCHING``: not found, stop and keep the camera still.
            ``ACQUIRING``: there is no valid model.
        sighting: Where the target is, None unless ``TRACKING``.
        match: Share of the target that agreed with the best model, 0 to 1.
    """

    phase: Phase
    sighting: Sighting | None
    match: float


class TargetTracker:
    """Looks at one camera's pictures, one after the other; begins with acquisition."""

    def look(self, frame: Picture) -> Track:
        """Return where the target is in the next picture.

        Raises:
            ValueError: It is no grey picture.
        """
        raise NotImplementedError

    def forget(self) -> None:
        """Begin again with acquisition: somebody else may have moved the robot."""
        raise NotImplementedError
