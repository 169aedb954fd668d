"""The simulated world: a room, robots that obey radio packets, and targets that walk along paths.

The world only steps physics; ``scout_model.camera`` draws pictures from its MJCF and state, in other processes. The
same description and the same packets at the same frames give the same state, bit for bit, on the same machine.

A robot that stands still is asleep: it costs no time, and its part of the state stays the same, bit for bit, until a
body touches it or an actuator gets a control other than 0.
"""

from __future__ import annotations

import math

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from scout_model.battery import Battery
from scout_model.carrier import CarriedPose, trips
from scout_model.composition import compose, model_of
from scout_model.description import WorldDescription
from scout_model.dimensions import FRAMES_PER_S, STEP_S, STEPS_PER_FRAME
from scout_model.errors import InvalidWorld, UnknownBody
from scout_model.readings import Senses, parts_by_robot
from scout_model.robot import PoweredRobot
from scout_model.robot_body import RobotBody, body_of
from scout_model.scout import Scout, Spring
from scout_model.stability import Stability
from scout_model.targets import Route, TargetState, part_poses, parts

STATE = mujoco.mjtState.mjSTATE_QPOS | mujoco.mjtState.mjSTATE_MOCAP_POS | mujoco.mjtState.mjSTATE_MOCAP_QUAT
"""The part of MuJoCo's state that determines a picture."""


class WorldMemory(msgspec.Struct, frozen=True):
    """What a world saves for the next process that simulates it.

    Attributes:
        frame: Frames stepped.
        positions: Robot → positions of its joints.
        charges: Robot with a battery → its charge, 0 to 1.
    """

    frame: int
    positions: dict[str, list[float]]
    charges: dict[str, float]


class World:
    """A world at frame 0: Scouts at rest with their transmitters off, targets at the beginning of their paths.

    Raises:
        InvalidWorld: The description cannot be built.
    """

    def __init__(self, description: WorldDescription) -> None:
        self.mjcf = compose(description)
        """The world's model, from which ``Camera`` builds an identical one."""
        # From the text, not from the composed model, so that the world steps exactly the model that viewers draw.
        self._model = model_of(self.mjcf)
        self._data = mujoco.MjData(self._model)
        # MuJoCo's arrays stay where they are; each look-up of one in its data makes a new array of it.
        self._velocities, self._controls = self._data.qvel, self._data.ctrl
        self._mocap_positions, self._mocap_quaternions = self._data.mocap_pos, self._data.mocap_quat
        self._tree_asleep = self._data.tree_asleep
        self._state_length = mujoco.mj_stateSize(self._model, STATE)
        self.frame = 0
        """Frames stepped so far."""
        self._step = 0
        self._stands = False  # True: the last step found nothing that moves, and would find the same again
        actuators = parts_by_robot(self._model.actuator(actuator).name for actuator in range(self._model.nu))
        roots = self._model.body_rootid[self._model.jnt_bodyid]
        self._robots = {
            place.name: body_of(self._model, place, actuators.get(place.name, {}), roots)
            for place in description.robots
        }
        programs = {name: robot.program for name, robot in self._robots.items()}
        self._powered = {name: one for name, one in programs.items() if isinstance(one, PoweredRobot)}
        self._by_network_id = {place.network_id: self._robots[place.name] for place in description.robots}
        self._trips = trips(description)
        self._carried = {place.name: self._trips[place.carried_by] for place in description.robots if place.carried_by}
        self._rest = self._data.qpos.copy()
        self._targets = {target.name: target for target in description.targets}
        self._whereabouts = {
            target.name: self._trips[target.name].pose if target.name in self._trips else Route(target).where
            for target in description.targets
        }
        self._mocap = {
            part.body: int(self._model.body(part.body).mocapid[0])
            for target in description.targets
            for part in part_poses(target, 0.0)
        }
        self._placed: dict[str, TargetState] = {}
        self._place_targets()
        self._hold_carried()
        mujoco.mj_forward(self._model, self._data)
        self._stability = Stability(self._model, self._data, {place.name: place.kind for place in description.robots})
        self._senses = Senses(self._model, self._data, programs)

    @property
    def time_s(self) -> float:
        """World time: frames stepped so far, in seconds."""
        return self.frame / FRAMES_PER_S

    @property
    def stands(self) -> bool:
        """True if no robot moved in the last frame."""
        return self._stands

    def memory(self) -> WorldMemory:
        """Return what to save now."""
        positions, now_s = self._data.qpos.tolist(), self.time_s
        return WorldMemory(
            self.frame,
            {name: positions[robot.positions] for name, robot in self._robots.items()},
            {name: program.battery.share(now_s) for name, program in self._powered.items()},
        )

    def resume(self, memory: WorldMemory) -> None:
        """Continue from an earlier world of the same description, with robots at rest; only at frame 0.

        A robot that the earlier world did not have, or whose body has other joints by now, stays where it is.
        """
        self.frame, self._step = memory.frame, memory.frame * STEPS_PER_FRAME
        self._place_targets()
        self._hold_carried()
        for name, robot in self._robots.items():
            positions = memory.positions.get(name, [])
            if name not in self._carried and len(positions) == len(self._data.qpos[robot.positions]):
                self._data.qpos[robot.positions] = positions
        for name, program in self._powered.items():
            if name in memory.charges:
                program.battery = Battery(program.battery.capacity_j, min(1.0, max(0.0, memory.charges[name])))
        mujoco.mj_forward(self._model, self._data)
        self._senses.update(self.time_s)

    def hear(self, network_id: int, payload: bytes) -> None:
        """Deliver a radio packet: the robot with this id obeys it from the next frame on.

        A packet to an unknown id is lost; a robot ignores and counts malformed bytes.
        """
        robot = self._by_network_id.get(network_id)
        if robot is not None:
            robot.program.hear(payload, self.time_s)

    def reply(self, network_id: int) -> bytes:
        """Return the reply of the robot with this id to the packets since its last reply.

        Empty if there is no reply, if the kind of robot never replies, or if no robot has this id.
        """
        robot = self._by_network_id.get(network_id)
        if robot is None or not robot.answers:
            return b""
        return robot.answers.reply(self.time_s)

    def strike(
        self, robot: str, velocity_m_s: tuple[float, float, float], spin_rad_s: tuple[float, float, float]
    ) -> None:
        """Give a robot a blow: add these velocities to those of its body.

        Args:
            robot: Its name; a blow to a carried robot has no effect.
            velocity_m_s: Added along the room's x, y, z.
            spin_rad_s: Added about the body's own axes: forward, left, up.

        Raises:
            UnknownBody: No robot has this name.
            ValueError: A number is not finite.
        """
        blow = (*velocity_m_s, *spin_rad_s)
        if not all(math.isfinite(part) for part in blow):
            raise ValueError(f"a blow of {blow}")
        first = self._robot(robot).velocities.start
        self._data.qvel[first : first + 6] += blow

    def step_frame(self) -> None:
        """Advance by one frame, a thirtieth of a second.

        Raises:
            UnstableBody: MuJoCo cannot compute the motion of a body; the world is of no further use.
        """
        now_s = self.time_s
        driven = [self._drive(robot, now_s) for robot in self._robots.values()]
        if not any(driven) and not self._carried and self._is_all_asleep():
            self._step += STEPS_PER_FRAME
            if self._place_targets() or not self._stands:
                # No robot moves: one step is enough to detect robots that a target touches, and to wake them.
                self._senses.step()
            self._stands = True
        else:
            self._step_bodies()
            self._stands = False
        self._stability.check()
        self.frame += 1
        self._senses.update(self.time_s)

    def _step_bodies(self) -> None:
        for step in range(1, STEPS_PER_FRAME + 1):
            if step < STEPS_PER_FRAME:
                mujoco.mj_step(self._model, self._data)
            else:
                self._senses.step()
            self._step += 1
            self._place_targets()
            self._hold_carried()

    def transmitting(self) -> dict[str, str]:
        """Return robot → video frequency, for robots whose transmitter is on."""
        return {name: robot.program.frequency for name, robot in self._robots.items() if robot.program.frequency}

    def state(self) -> NDArray[np.float64]:
        """Return all positions in the world as one vector that only a camera of this world can read."""
        state = np.empty(self._state_length)
        mujoco.mj_getState(self._model, self._data, state, STATE)
        return state

    def pose(self, body: str) -> tuple[float, float, float]:
        """Return the pose of a Scout or target: x and y in metres, heading in radians, -pi to pi.

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
        """Return the speeds of a Scout's left and right wheel in rad/s; forward is positive.

        Raises:
            UnknownBody: No Scout has this name.
        """
        self._scout(robot)
        left, right = (int(self._model.joint(f"{robot}/{wheel}").dofadr[0]) for wheel in ("left_wheel", "right_wheel"))
        return float(self._data.qvel[left]), float(self._data.qvel[right])

    def motors(self, robot: str) -> float:
        """Return the load of a robot's motors, 0 to 1; they disturb its own picture.

        Raises:
            UnknownBody: No robot has this name.
        """
        return self._robot(robot).program.motors

    def is_asleep(self, robot: str) -> bool:
        """Return whether a robot is asleep: it is frozen until a body touches it or its actuators move it.

        Raises:
            UnknownBody: No robot has this name.
        """
        self._robot(robot)
        return bool(self._data.tree_asleep[self._model.body_treeid[self._model.body(f"{robot}/body").id]] >= 0)

    def is_upright(self, robot: str) -> bool:
        """Return whether a robot's upper side is up.

        Raises:
            UnknownBody: No robot has this name.
        """
        self._robot(robot)
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, self._quaternion(robot))
        return bool(rotation[8] > 0)

    def is_carried(self, robot: str) -> bool:
        """Return whether a carrier still holds a robot.

        Raises:
            UnknownBody: No robot has this name.
        """
        self._robot(robot)
        return robot in self._carried

    def spring(self, robot: str) -> Spring:
        """Return the phase of a Scout's spring foot.

        Raises:
            UnknownBody: No Scout has this name.
        """
        return self._scout(robot).spring

    def _robot(self, name: str) -> RobotBody:
        robot = self._robots.get(name)
        if robot is None:
            raise UnknownBody(f"no robot named {name!r}")
        return robot

    def _scout(self, name: str) -> Scout:
        program = self._robots[name].program if name in self._robots else None
        if not isinstance(program, Scout):
            raise UnknownBody(f"no Scout named {name!r}")
        return program

    def _is_all_asleep(self) -> bool:
        return min(self._tree_asleep.tolist(), default=0) >= 0 and not np.count_nonzero(self._velocities)

    def _drive(self, robot: RobotBody, now_s: float) -> bool:
        """Apply the robot program's outputs to the actuators; return whether any is not 0, which wakes the body."""
        controls = robot.program.controls(now_s)
        if controls != robot.controls:
            for actuator, control in controls.items():
                if (number := robot.actuators.get(actuator)) is None:
                    there = ", ".join(robot.actuators)
                    raise InvalidWorld(f"{robot.kind} drives {actuator!r}, but the actuators of its body are: {there}")
                self._controls[number] = control
            robot.controls.update(controls)
        is_driven = any(controls.values())
        if is_driven:
            # Controls do not wake a sleeping body, but any bit in its velocity does: the negative zero has one.
            first = robot.velocities.start
            if self._velocities[first] == 0.0:
                self._velocities[first] = -0.0
        return is_driven

    def _free_joint(self, robot: str) -> NDArray[np.float64]:
        free = self._robots[robot].free
        position: NDArray[np.float64] = self._data.qpos[free : free + 7]
        return position

    def _quaternion(self, body: str) -> NDArray[np.float64]:
        if body in self._robots:
            return self._free_joint(body)[3:]
        quaternion: NDArray[np.float64] = self._data.mocap_quat[self._mocap[body]]
        return quaternion

    def _place_targets(self) -> bool:
        """Place the targets where they are by now; return whether one of them moved."""
        time_s, moved = self._step * STEP_S, False
        for name, target in self._targets.items():
            pose = self._whereabouts[name](time_s)
            placed = self._placed.get(name)
            if pose is placed or pose == placed:
                continue
            self._placed[name], moved = pose, True
            for part in parts(target, pose):
                mocap = self._mocap[part.body]
                self._mocap_positions[mocap] = part.position_m
                self._mocap_quaternions[mocap] = part.quaternion
        return moved

    def _hold_carried(self) -> None:
        if not self._carried:
            return
        time_s = self._step * STEP_S
        for name in list(self._carried):
            held, body = self._carried[name].held(name, time_s), self._robots[name]
            self._data.qpos[body.positions] = self._rest[body.positions]
            self._data.qvel[body.velocities] = 0.0
            if held is None:
                del self._carried[name]
            else:
                self._data.qpos[body.free : body.free + 7] = _free_position(held)


def _free_position(held: CarriedPose) -> list[float]:
    half_rad = held.heading_rad / 2
    return [held.x_m, held.y_m, held.z_m, math.cos(half_rad), 0.0, 0.0, math.sin(half_rad)]
