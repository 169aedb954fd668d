"""Dark search: look around for the darkest direction, drive a leg there, look again; stop where it is dark all around.

Rules of this file: no bus, no clock. Pictures and mission time go in, motions come out.

A Scout has no odometry: directions are relative to the begin of the look around, computed from the commanded turn, and
dropped at the next look around. After an interruption, a comparison with earlier views shows whether the robot still
stands at its place. If so, the look around continues; otherwise it begins again.

Source: RAM 2002, "Visual Servoing", on earlier work: behaviors that navigated by patches of light and dark. Numbers:
chosen in simulated rooms with a dark corner and with a table.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from mission_control.behaviors.motion import STILL, Motion, turned
from mission_control.behaviors.patrol_route import LONGEST_STEP_S

Picture = NDArray[np.uint8]

TURN_RAD_S = 0.8  # chosen: a look around takes eight seconds
SECTORS = 18  # chosen: 20 degrees, half of the camera's angle of view
NEAREST_M, FARTHEST_M = 0.25, 2.0  # chosen: rows that show the floor; 40 of 240
NEAR_ROWS = 0.12  # chosen: the lowest rows show the floor 15 to 20 cm before the robot
AHEAD_COLUMNS = (1 / 3, 2 / 3)  # chosen: 13 degrees, less than a sector
HORIZON, CAMERA_HEIGHT = 150.2 / 240, 11.4 / 240  # the Scout's camera: rows of the horizon and of a meter's floor
ALL_AROUND = 0.75  # chosen: legs of furniture and the way out may be bright
IN_M, BACK_M = 0.35, 0.12  # chosen: three body lengths into the dark; one body length before a possible obstacle
CERTAIN_PICTURES = 4  # chosen: torn pictures come two or three in a row
CHOICES = 4  # chosen: the darkest direction is often a shadow line; then other directions are tried
BARRED_RAD = math.radians(60.0)  # chosen: excludes the way back to the last place
SAME_VIEW, VIEW_COLUMNS, VIEW_ROWS = 9.0, 40, 15  # chosen: grey levels between views of 8 by 16 pixels
SHIFTS = 8  # chosen: columns of such a view, 8 degrees; a robot stopped in a turn coasts less than that
COMPARED = 10  # chosen: the first pictures after switching on roll


class SearchStage(StrEnum):
    """Stage of the search."""

    LOOK = "looks around"
    TURN = "turns to where it looked darkest"
    GO = "goes there"
    ENTER = "goes into the dark"
    BACK = "backs off a little"
    FACE_OUT = "turns to look out"
    HIDDEN = "is hidden"
    FAILED = "found no dark place"


@dataclass(frozen=True, slots=True, eq=False)
class Glimpse:
    """Light in a picture.

    Attributes:
        ahead: Mean brightness straight ahead, with equal weight for near and far, 0 to 255.
        ground: Mean brightness of the floor right before the robot.
        view: The picture in coarse blocks, shape (``VIEW_ROWS``, ``VIEW_COLUMNS``).
    """

    ahead: float
    ground: float
    view: NDArray[np.float32]


def glimpse(picture: Picture) -> Glimpse:
    """Return the light in a picture.

    Args:
        picture: Grey levels 0 to 255, shape (height, width), row 0 on top; at least 15 by 40 pixels.

    Raises:
        ValueError: The picture has another shape.
    """
    if picture.ndim != 2 or picture.shape[0] < VIEW_ROWS or picture.shape[1] < VIEW_COLUMNS:
        raise ValueError(f"a grey picture of at least {VIEW_COLUMNS} by {VIEW_ROWS} pixels, not {picture.shape}")
    height, width = picture.shape
    middle = picture[:, round(AHEAD_COLUMNS[0] * width) : round(AHEAD_COLUMNS[1] * width)]
    distances_m = np.linspace(NEAREST_M, FARTHEST_M, 15)
    rows = np.minimum(((HORIZON + CAMERA_HEIGHT / distances_m) * height).astype(int), height - 1)
    ahead = (float(middle.mean()) + float(middle[rows].mean())) / 2
    ground = float(picture[-max(1, round(NEAR_ROWS * height)) :].mean())
    tall, wide = height // VIEW_ROWS, width // VIEW_COLUMNS
    blocks = picture[: tall * VIEW_ROWS, : wide * VIEW_COLUMNS].reshape(VIEW_ROWS, tall, VIEW_COLUMNS, wide)
    return Glimpse(ahead, ground, blocks.mean(axis=(1, 3), dtype=np.float32))


def is_same_view(before: NDArray[np.float32], now: NDArray[np.float32]) -> bool:
    """Return True if both views may come from one place, with a turn of a few degrees at most."""
    width = before.shape[1]
    for shift in range(-SHIFTS, SHIFTS + 1):
        here = before[:, max(0, shift) : width + min(0, shift)]
        there = now[:, max(0, -shift) : width - max(0, shift)]
        if float(np.abs(here - there).mean()) < SAME_VIEW:
            return True
    return False


class DarkSearch:
    """The state of a search.

    Args:
        dark_level: Floor darker than this is dark, 0 to 255.
        leg_m: Distance to drive before the next look around.
        looks: Number of looks around after which the search gives up; 0: never.
    """

    def __init__(self, *, dark_level: float, leg_m: float, speed_m_s: float, looks: int) -> None:
        self._dark_level, self._leg_m, self._speed_m_s, self._most_looks = dark_level, leg_m, speed_m_s, looks
        self.stage = SearchStage.LOOK
        """The stage of the search."""
        self.looks = 0
        """Number of finished looks around."""
        self._left = 0.0  # remaining radians or meters of the stage
        self._turned_rad = 0.0  # since the look around began
        self._seen: list[tuple[float, float, float]] = []
        self._barred_rad: float | None = None
        self._dark_pictures = 0
        self._decided_s: float | None = None
        self._last = STILL
        self._view: NDArray[np.float32] | None = None
        self._to_compare = 0
        self._begin_look()

    @property
    def is_final(self) -> bool:
        """True when the robot is hidden, or the search has given up."""
        return self.stage in (SearchStage.HIDDEN, SearchStage.FAILED)

    def interrupt(self) -> None:
        """Record the loss of the robot; the next pictures show whether it was moved meanwhile."""
        self._decided_s, self._last = None, STILL
        self._to_compare = COMPARED

    def decide(self, seen: Glimpse, now_s: float) -> Motion:
        """Return how to move now.

        Args:
            seen: Light in the newest picture.
            now_s: Mission time of that picture; it never decreases.
        """
        if self.is_final:
            return STILL
        if self._to_compare and self._view is not None and not self._is_back(seen):
            return STILL
        self._view = seen.view
        passed_s = 0.0 if self._decided_s is None else min(now_s - self._decided_s, LONGEST_STEP_S)
        self._decided_s = now_s
        self._take_in(seen, passed_s)
        self._last = self._motion()
        return self._last

    def _is_back(self, seen: Glimpse) -> bool:
        """Return whether the pictures since an interruption are enough; begin again if the robot was moved."""
        assert self._view is not None  # noqa: S101  asked only then
        self._to_compare -= 1
        if is_same_view(self._view, seen.view):
            self._to_compare = 0
        elif not self._to_compare:
            self._barred_rad = None
            self._begin_look()
        return not self._to_compare

    def _take_in(self, seen: Glimpse, passed_s: float) -> None:
        """Add the effect of the last motion; enter the next stage when the present one is finished."""
        turned_rad, gone_m = self._last.turn_rad_s * passed_s, abs(self._last.forward_m_s) * passed_s
        self._turned_rad += turned_rad
        self._dark_pictures = self._dark_pictures + 1 if seen.ground < self._dark_level else 0
        match self.stage:
            case SearchStage.LOOK:
                self._seen.append((self._turned_rad, seen.ahead, seen.ground))
                if self._turned_rad >= 2 * math.pi:
                    self.looks += 1
                    self._conclude()
            case SearchStage.TURN | SearchStage.FACE_OUT:
                before, self._left = self._left, self._left - turned_rad
                if before * self._left <= 0 or abs(self._left) < 0.02:
                    self._after_turn()
            case SearchStage.GO:
                self._left -= gone_m
                if self._dark_pictures >= CERTAIN_PICTURES:
                    self._enter(SearchStage.ENTER, IN_M)
                elif self._left <= 0:
                    self._begin_look()
            case SearchStage.ENTER:
                self._left -= gone_m
                if self._left <= 0:
                    self._enter(SearchStage.BACK, BACK_M)
            case SearchStage.BACK:
                self._left -= gone_m
                if self._left <= 0:
                    self._begin_look()
            case SearchStage.HIDDEN | SearchStage.FAILED:
                return

    def _conclude(self) -> None:
        """Decide from all views of a look around."""
        is_dark = [ground < self._dark_level for _angle, _ahead, ground in self._seen]
        if sum(is_dark) >= ALL_AROUND * len(is_dark):
            brightest = sectors(self._seen, brightest=True)[0]
            self._enter(SearchStage.FACE_OUT, turned(brightest - self._turned_rad))
        elif self.looks == self._most_looks:
            self._enter(SearchStage.FAILED, 0.0)
        else:
            barred = self._barred_rad
            ways = [way for way in sectors(self._seen) if barred is None or abs(turned(way - barred)) > BARRED_RAD]
            way = ways[(self.looks - 1) % CHOICES]
            self._enter(SearchStage.TURN, turned(way - self._turned_rad))

    def _after_turn(self) -> None:
        if self.stage is SearchStage.FACE_OUT:
            self._enter(SearchStage.HIDDEN, 0.0)
        else:
            self._enter(SearchStage.GO, self._leg_m)
            self._barred_rad = math.pi  # relative to the next look around, whose begin is straight ahead

    def _begin_look(self) -> None:
        self._seen, self._turned_rad = [], 0.0
        self._enter(SearchStage.LOOK, 0.0)

    def _enter(self, stage: SearchStage, left: float) -> None:
        self.stage, self._left, self._dark_pictures = stage, left, 0

    def _motion(self) -> Motion:
        match self.stage:
            case SearchStage.LOOK:
                return Motion(0.0, TURN_RAD_S)
            case SearchStage.TURN | SearchStage.FACE_OUT:
                return Motion(0.0, math.copysign(TURN_RAD_S, self._left))
            case SearchStage.GO | SearchStage.ENTER:
                return Motion(self._speed_m_s, 0.0)
            case SearchStage.BACK:
                return Motion(-self._speed_m_s, 0.0)
            case SearchStage.HIDDEN | SearchStage.FAILED:
                return STILL


def sectors(seen: Sequence[tuple[float, float, float]], *, brightest: bool = False) -> list[float]:
    """Return the directions of all observed sectors, darkest first or brightest first.

    Args:
        seen: Direction in radians, brightness ahead, and brightness of the ground, of each picture.
        brightest: True: the brightest first.

    Returns:
        Middles of sectors, radians from 0 to 2 pi.
    """
    width_rad = 2 * math.pi / SECTORS
    ahead: list[list[float]] = [[] for _sector in range(SECTORS)]
    for angle_rad, brightness, _ground in seen:
        ahead[int(angle_rad / width_rad) % SECTORS].append(brightness)
    found = [(sum(levels) / len(levels), (sector + 0.5) * width_rad) for sector, levels in enumerate(ahead) if levels]
    return [way for _level, way in sorted(found, reverse=brightest)]
