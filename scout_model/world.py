"""The simulated world: a room, Scouts that obey their radio, and targets that walk their paths.

It steps physics and nothing else: pictures are drawn by ``scout_model.camera``, elsewhere, from the
world's MJCF and state.  The same description and the same packets at the same frames give the same
state, bit for bit, on the same machine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from scout_model.composition import compose
from scout_model.description import WorldDescription
from scout_model.dimensions import FRAMES_PER_S, STEP_S, STEPS_PER_FRAME
from scout_model.errors import UnknownBody
from scout_model.scout import Firmware, FirmwareStatistics, Spring
from scout_model.targets import part_poses

STATE = mujoco.mjtState.mjSTATE_QPOS | mujoco.mjtState.mjSTATE_MOCAP_POS | mujoco.mjtState.mjSTATE_MOCAP_QUAT
"""What of MuJoCo's state a picture depends on."""


@dataclass(frozen=True, slots=True)
class _Robot:
    firmware: Firmware
    left_wheel: int
    right_wheel: int
    kick: int
    winch: int
    left_wheel_velocity: int
    right_wheel_velocity: int


class World:
    """A world at frame 0: Scouts at rest with their transmitters off, targets at the beginning of their paths.

    Raises:
        InvalidWorld: The description cannot be built.
    """

    def __init__(self, description: WorldDescription) -> None:
        self._mjcf = compose(description)
        # From the text, not from the composed model: the world steps the very model its viewers draw.
        self._model = mujoco.MjModel.from_xml_string(self._mjcf)
        self._data = mujoco.MjData(self._model)
        self._frame = 0
        self._step = 0
        self._robots = {place.name: self._robot(place.name) for place in description.scouts}
        self._by_network_id = {place.network_id: self._robots[place.name] for place in description.scouts}
        self._targets = {target.name: target for target in description.targets}
        self._mocap = {
            part.body: int(self._model.body(part.body).mocapid[0])
            for target in description.targets
            for part in part_poses(target, 0.0)
        }
        self._place_targets()
        mujoco.mj_forward(self._model, self._data)

    @property
    def mjcf(self) -> str:
        """The world's model, from which ``Camera`` builds an identical one."""
        return self._mjcf

    @property
    def frame(self) -> int:
        """Frames stepped so far."""
        return self._frame

    @property
    def time_s(self) -> float:
        """World time: frames stepped so far, in seconds."""
        return self._frame / FRAMES_PER_S

    def hear(self, network_id: int, payload: bytes) -> None:
        """Let a radio packet reach the robots: the one with this id obeys from the next frame on, others never.

        A packet to an id nobody has is lost in the air; malformed bytes are ignored and counted by the robot.
        """
        robot = self._by_network_id.get(network_id)
        if robot is not None:
            robot.firmware.hear(payload, self.time_s)

    def step_frame(self) -> None:
        """Advance by one frame, a thirtieth of a second."""
        for robot in self._robots.values():
            actuation = robot.firmware.tick(self.time_s)
            self._data.ctrl[robot.left_wheel] = actuation.left_rad_s
            self._data.ctrl[robot.right_wheel] = actuation.right_rad_s
            self._data.ctrl[robot.kick] = float(actuation.kick)
            self._data.ctrl[robot.winch] = actuation.winch_m
        for _ in range(STEPS_PER_FRAME):
            mujoco.mj_step(self._model, self._data)
            self._step += 1
            self._place_targets()
        self._frame += 1

    def transmitting(self) -> dict[str, str]:
        """Return robot → video frequency, of the robots whose transmitter is on."""
        return {name: robot.firmware.frequency for name, robot in self._robots.items() if robot.firmware.frequency}

    def state(self) -> NDArray[np.float64]:
        """Return all positions in the world as one vector that only a camera of this world can read."""
        state = np.empty(mujoco.mj_stateSize(self._model, STATE))
        mujoco.mj_getState(self._model, self._data, state, STATE)
        return state

    def pose(self, body: str) -> tuple[float, float, float]:
        """Return where a Scout or target is: x and y in metres, heading in radians, -pi to pi.

        Raises:
            UnknownBody: No Scout or target has this name.
        """
        x_m, y_m, _ = self.position_m(body)
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, self._quaternion(body))
        return x_m, y_m, math.atan2(rotation[3], rotation[0])

    def position_m(self, body: str) -> tuple[float, float, float]:
        """Return x, y, z of a Scout's axle or of the floor under a target, metres.

        Raises:
            UnknownBody: No Scout or target has this name.
        """
        if body in self._robots:
            x_m, y_m, z_m = self._free_joint(body)[:3]
        elif body in self._targets:
            x_m, y_m, z_m = self._data.mocap_pos[self._mocap[body]]
        else:
            raise UnknownBody(f"no Scout or target named {body!r}")
        return float(x_m), float(y_m), float(z_m)

    def wheel_speeds(self, robot: str) -> tuple[float, float]:
        """Return how fast a Scout's wheels turn, left and right, rad/s, forward is positive.

        Raises:
            UnknownBody: No Scout has this name.
        """
        scout = self._scout(robot)
        velocities = self._data.qvel
        return float(velocities[scout.left_wheel_velocity]), float(velocities[scout.right_wheel_velocity])

    def spring(self, robot: str) -> Spring:
        """Return where a Scout's spring foot is in its jump.

        Raises:
            UnknownBody: No Scout has this name.
        """
        return self._scout(robot).firmware.spring

    def firmware_statistics(self, robot: str) -> FirmwareStatistics:
        """Return what a Scout's firmware counted.

        Raises:
            UnknownBody: No Scout has this name.
        """
        return self._scout(robot).firmware.statistics()

    def _scout(self, name: str) -> _Robot:
        robot = self._robots.get(name)
        if robot is None:
            raise UnknownBody(f"no Scout named {name!r}")
        return robot

    def _robot(self, name: str) -> _Robot:
        model = self._model
        return _Robot(
            firmware=Firmware(),
            left_wheel=model.actuator(f"{name}/left_wheel").id,
            right_wheel=model.actuator(f"{name}/right_wheel").id,
            kick=model.actuator(f"{name}/kick").id,
            winch=model.actuator(f"{name}/winch").id,
            left_wheel_velocity=int(model.joint(f"{name}/left_wheel").dofadr[0]),
            right_wheel_velocity=int(model.joint(f"{name}/right_wheel").dofadr[0]),
        )

    def _free_joint(self, robot: str) -> NDArray[np.float64]:
        joint = int(self._model.joint(f"{robot}/free").qposadr[0])
        position: NDArray[np.float64] = self._data.qpos[joint : joint + 7]
        return position

    def _quaternion(self, body: str) -> NDArray[np.float64]:
        if body in self._robots:
            return self._free_joint(body)[3:]
        quaternion: NDArray[np.float64] = self._data.mocap_quat[self._mocap[body]]
        return quaternion

    def _place_targets(self) -> None:
        time_s = self._step * STEP_S
        positions, quaternions = self._data.mocap_pos, self._data.mocap_quat
        for target in self._targets.values():
            for part in part_poses(target, time_s):
                mocap = self._mocap[part.body]
                positions[mocap] = part.position_m
                quaternions[mocap] = part.quaternion
