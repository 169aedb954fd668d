"""Detects that MuJoCo could not compute a step of the world.

MuJoCo then warns only: after an impossible control it sets all controls to zero, and after an impossible motion it puts
every body back at its beginning. Both would change robots that are not the cause, and no robot would move again.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping

import mujoco

from scout_model.errors import UnstableBody

log = logging.getLogger(__name__)

_CONTROL = int(mujoco.mjtWarning.mjWARN_BADCTRL)
_MOTION = [
    int(mujoco.mjtWarning.mjWARN_BADQPOS),
    int(mujoco.mjtWarning.mjWARN_BADQVEL),
    int(mujoco.mjtWarning.mjWARN_BADQACC),
]
_HUGE = 1e10  # MuJoCo, mjMAXVAL


class Stability:
    """The warnings of one world.

    Args:
        kinds: Robot → class path.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, kinds: Mapping[str, str]) -> None:
        self._model, self._kinds = model, kinds
        self._counts, self._places = data.warning.number, data.warning.lastinfo
        mujoco.set_mju_user_warning(_log)  # otherwise MuJoCo writes a file MUJOCO_LOG.TXT into the present folder

    def check(self) -> None:
        """Check that MuJoCo has computed all steps until now.

        Raises:
            UnstableBody: It has not; the text names robot and part.
        """
        counts = self._counts.tolist()
        if not any(counts):
            return
        if counts[_CONTROL]:
            robot, actuator = self._part(self._model.actuator(int(self._places[_CONTROL])).name)
            raise UnstableBody(f"{robot} sets its actuator {actuator!r} to no number, or to one above {_HUGE:g}")
        for warning in _MOTION:
            if counts[warning]:
                joint = self._model.joint(int(self._model.dof_jntid[int(self._places[warning])]))
                robot, part = self._part(joint.name)
                raise UnstableBody(f"{robot} moves too fast to be computed, first at its joint {part!r}")

    def _part(self, name: str) -> tuple[str, str]:
        """Return the robot with its class path, and its part, of a MuJoCo name."""
        robot, _, part = name.partition("/")
        return (f"{robot} ({self._kinds[robot]})", part) if robot in self._kinds else ("the room", name)


def _log(text: str) -> None:
    log.warning("MuJoCo: %s", text)
