"""Robot body: a robot's on-board program, and the places of its parts in MuJoCo's arrays."""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from scout_model.description import RobotPlace
from scout_model.robot import AnsweringRobot, Robot, answering, fit_battery, robot_class

_FREE = int(mujoco.mjtJoint.mjJNT_FREE)
_BALL = int(mujoco.mjtJoint.mjJNT_BALL)
_SLIDE, _HINGE = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE)
_POSITIONS = {_FREE: 7, _BALL: 4, _SLIDE: 1, _HINGE: 1}
_VELOCITIES = {_FREE: 6, _BALL: 3, _SLIDE: 1, _HINGE: 1}


@dataclass(frozen=True, slots=True)
class RobotBody:
    """A robot's program, and the places of its parts in MuJoCo's arrays.

    Attributes:
        kind: Class path, for refusals.
        program: The on-board program.
        answers: The same program, if it is an ``AnsweringRobot``.
        actuators: Name → index of its control.
        free: First of the seven numbers of its position.
        positions: Its part of the positions.
        velocities: Its part of the velocities.
        controls: What drives its actuators now.
    """

    kind: str
    program: Robot
    answers: AnsweringRobot | None
    actuators: dict[str, int]
    free: int
    positions: slice
    velocities: slice
    controls: dict[str, float] = field(default_factory=dict)


def body_of(model: mujoco.MjModel, place: RobotPlace, actuators: dict[str, int], roots: NDArray[np.int32]) -> RobotBody:
    """Return the robot at this place.

    Args:
        model: The world's model.
        place: The robot's declaration.
        actuators: Name → number.
        roots: Root of the tree of bodies of each joint of the world.
    """
    name, kind = place.name, place.kind
    free = model.joint(f"{name}/free")
    last = np.flatnonzero(roots == roots[free.id])[-1]
    last_position = int(model.jnt_qposadr[last]) + _POSITIONS[int(model.jnt_type[last])]
    last_velocity = int(model.jnt_dofadr[last]) + _VELOCITIES[int(model.jnt_type[last])]
    program = robot_class(kind)()
    if place.battery_j is not None:
        fit_battery(program, place.battery_j, kind)
    return RobotBody(
        kind=kind,
        program=program,
        answers=answering(program),
        actuators=actuators,
        free=int(free.qposadr[0]),
        positions=slice(int(free.qposadr[0]), last_position),
        velocities=slice(int(free.dofadr[0]), last_velocity),
    )
