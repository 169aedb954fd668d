"""What the keys of a console do: the one thing its screen knows of the rest."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from backbone.log_question import LogQuestion
from backbone.mission_log import AskLog, Log
from ui_console.console_model import ConsoleModel
from ui_console.driving import Drive


class Session(Protocol):
    """What the keys of a console do."""

    model: ConsoleModel

    def picture(self) -> NDArray[np.uint8] | None:
        """Return the newest picture, grey levels, shape (height, width), or None."""

    def now_s(self) -> float:
        """Return the mission time."""

    def hold(self, drive: Drive, lasts_s: float | None = None) -> None:
        """A drive key is down, or for so long what says so again."""

    def stop(self) -> None:
        """Stop the wheels now."""

    def require_let_go(self) -> None:
        """What is held down now drives no more until it was let go and is pressed anew."""

    def jump(self) -> None:
        """Jump once."""

    def take(self) -> None:
        """Ask for the robot."""

    def release(self) -> None:
        """Give the robot back."""

    def ask_consent(self, why: str = "") -> None:
        """Ask the operator who holds the robot for it."""

    def decide(self, is_given: bool) -> None:
        """Answer the operator who asks for the robot, or to lift a stop."""

    def dismiss_lost(self) -> None:
        """The operator knows that a robot was lost."""

    async def switch(self, robot: str) -> None:
        """Give the robot back and ask for this one."""

    def touch(self) -> None:
        """A key was pressed."""

    def leave(self) -> None:
        """The window is no longer in front."""

    def closed(self) -> None:
        """The screen has gone, whatever ended it: the robot is given back, if one is held."""

    def acknowledge(self, key: str) -> None:
        """One alarm was seen; all, with an empty key."""

    async def stop_robot(self, robot: str) -> bool:
        """Emergency stop; return whether it is certain."""

    async def stop_all(self) -> list[str]:
        """Emergency stop of all; return the robots of which it is not certain."""

    async def lift_stop(self, robot: str, number: int) -> bool:
        """Let the robot move again, if those who stopped it let it; return whether it may.

        Args:
            robot: Which.
            number: Of the stop that was seen on the screen.
        """

    async def why(self, name: str) -> list[str]:
        """Return why it is as it is."""

    async def search_log(self, question: LogQuestion) -> tuple[AskLog, Log]:
        """Return what the mission's log has of this, and what was asked for that.

        Raises:
            Refusal: The question has no answer, or the launcher gives none.
        """

    async def ask_parameters(self, name: str) -> bool:
        """Have its parameters told; return whether they were."""

    async def set_parameter(self, name: str, parameter: str, value: object) -> bool:
        """Change one; return whether it was."""
