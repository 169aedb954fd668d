"""A walker in MuJoCo: motion control, packets twenty times a second, servo board, body; disturbed from a seed."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, field

import mujoco

from resource_pool.robots.walker import link
from resource_pool.robots.walker.body import Walker
from resource_pool.robots.walker.gait import LEGS, TROT, GaitParameters, TrunkSpeed
from resource_pool.robots.walker.link import JOINTS, JointTargets
from resource_pool.robots.walker.motion import STEP_S, MotionControl
from scout_model.composition import compose
from scout_model.description import RobotPlace, WorldDescription
from scout_model.dimensions import FRAMES_PER_S, STEPS_PER_FRAME

WALKER = "resource_pool.robots.walker.body:Walker"
PACKET_S = 0.05  # as resource_pool.messages.DEFAULT_DRIVE_USAGE
FALLEN_RAD = math.radians(30.0)
PUSH_M_S = 0.15
NOISE_RAD = 0.01


class Pilot:
    """Motion control at its own rate, and the packets of its newest targets."""

    def __init__(self, parameters: GaitParameters = TROT) -> None:
        self.control = MotionControl(parameters)
        self._steps = self._packets = 0
        self._targets_rad: link.Angles = ()

    def packets(self, now_s: float) -> list[bytes]:
        """Return the packet that is due by this time, if one is."""
        while self._steps * STEP_S <= now_s + 1e-9:
            self._targets_rad = self.control.step(self._steps * STEP_S)
            self._steps += 1
        if self._packets * PACKET_S > now_s + 1e-9:
            return []
        self._packets += 1
        return [link.encode_joint_targets(JointTargets(self._targets_rad, PACKET_S))]


@dataclass
class Walked:
    """What became of a walk.

    Attributes:
        forward_m: Way along the heading at the beginning.
        left_m: Same, to the left of it.
        turned_rad: How far it turned, counting turns.
        tilt_rad: The greatest tilt of the trunk.
        felt_wrong_rad: The greatest difference between the tilt it reported and its tilt.
        statuses: What it reported, thirty times a second.
    """

    forward_m: float = 0.0
    left_m: float = 0.0
    turned_rad: float = 0.0
    tilt_rad: float = 0.0
    felt_wrong_rad: float = 0.0
    statuses: list[link.Status] = field(default_factory=list)

    @property
    def fell(self) -> bool:
        """Whether it tilted so far that it fell."""
        return self.tilt_rad > FALLEN_RAD

    @property
    def aside_rad(self) -> float:
        """Direction of the way from beginning to end, seen from the heading at the beginning."""
        return math.atan2(self.left_m, self.forward_m)


class Trial:
    """One walker in an empty room.

    Args:
        seed: Of friction, first heading, three pushes and the servos' noise; None: nothing disturbs it.
    """

    def __init__(self, seed: int | None = None) -> None:
        self._rng = random.Random(seed)
        self._is_disturbed = seed is not None
        heading_rad = self._rng.uniform(-math.pi, math.pi) if self._is_disturbed else 0.0
        place = RobotPlace("walker1", 1, 6.0, 6.0, heading_rad, WALKER)
        self.model = mujoco.MjModel.from_xml_string(compose(WorldDescription(12.0, 12.0, robots=[place])))
        self.data = mujoco.MjData(self.model)
        if self._is_disturbed:
            friction = self._rng.uniform(0.5, 1.0)
            for leg in LEGS:
                self.model.geom(f"walker1/{leg}_foot").friction[0] = friction
        mujoco.mj_forward(self.model, self.data)
        self.walker = Walker()
        self._actuators = {joint: self.model.actuator(f"walker1/{joint}").id for joint in JOINTS}
        self._frame = 0

    @property
    def now_s(self) -> float:
        return self._frame / FRAMES_PER_S

    def walk(self, pilot: Pilot, seconds: float) -> Walked:
        """Return what becomes of the walker while the pilot's packets reach it."""
        walked = Walked()
        x_m, y_m = (float(part) for part in self.data.qpos[:2])
        before_rad = last_rad = self._heading_rad()
        end_s = self.now_s + seconds
        pushes_s = sorted(self._rng.uniform(self.now_s + 0.5, end_s) for _ in range(3 * self._is_disturbed))
        while self.now_s < end_s:
            if pushes_s and pushes_s[0] <= self.now_s:
                pushes_s.pop(0)
                self._push()
            self._step_frame(pilot.packets(self.now_s))
            self._observe(walked)
            heading_rad = self._heading_rad()
            walked.turned_rad += math.remainder(heading_rad - last_rad, math.tau)
            last_rad = heading_rad
        x_m, y_m = float(self.data.qpos[0]) - x_m, float(self.data.qpos[1]) - y_m
        walked.forward_m = x_m * math.cos(before_rad) + y_m * math.sin(before_rad)
        walked.left_m = y_m * math.cos(before_rad) - x_m * math.sin(before_rad)
        return walked

    def _push(self) -> None:
        direction_rad = self._rng.uniform(0.0, math.tau)
        self.data.qvel[:2] += PUSH_M_S * math.cos(direction_rad), PUSH_M_S * math.sin(direction_rad)

    def _step_frame(self, packets: list[bytes]) -> None:
        for packet in packets:
            self.walker.hear(packet, self.now_s)
        for joint, angle_rad in self.walker.controls(self.now_s).items():
            noise_rad = self._rng.gauss(0.0, NOISE_RAD) if self._is_disturbed else 0.0
            self.data.ctrl[self._actuators[joint]] = angle_rad + noise_rad
        for _ in range(STEPS_PER_FRAME):
            mujoco.mj_step(self.model, self.data)
        self._frame += 1
        self.walker.feel(self._readings(), self.now_s)

    def _readings(self) -> dict[str, list[float]]:
        model, data = self.model, self.data
        return {
            model.sensor(number).name.removeprefix("walker1/"): data.sensor(number).data.tolist()
            for number in range(model.nsensor)
        }

    def _observe(self, walked: Walked) -> None:
        rotation = self.data.body("walker1/body").xmat
        walked.tilt_rad = max(walked.tilt_rad, math.acos(min(1.0, rotation[8])))
        status = link.decode_status(self.walker.reply(self.now_s))
        roll_rad, pitch_rad = math.atan2(rotation[7], rotation[8]), math.asin(max(-1.0, min(1.0, -rotation[6])))
        wrong_rad = max(abs(status.roll_rad - roll_rad), abs(status.pitch_rad - pitch_rad))
        walked.felt_wrong_rad = max(walked.felt_wrong_rad, wrong_rad)
        walked.statuses.append(status)

    def _heading_rad(self) -> float:
        rotation = self.data.body("walker1/body").xmat
        return math.atan2(rotation[3], rotation[0])


def walk(move: TrunkSpeed, seconds: float, seed: int | None = None, parameters: GaitParameters = TROT) -> Walked:
    """Return what becomes of a walker whose motion control is asked for this motion from the beginning."""
    pilot = Pilot(parameters)
    pilot.control.request(move)
    return Trial(seed).walk(pilot, seconds)
