"""The servoing experiment: from a place before a landmark to the goal, in whole missions on a virtual clock.

Each trial begins up to 2.5 m from the board and up to 45 degrees off its zero-angle line, with any heading, and noise
on the air. It succeeds if the behavior succeeds and the robot really stands within 5 cm and 10 degrees of its goal.

Source: RAM 2002, "Visual Servoing": starts more than 2 m away; reached each time in uniform light.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from functools import lru_cache
from random import Random
from statistics import median

import msgspec

from backbone.bus.clock import run_virtual
from backbone.mission.model import MissionDescription
from backbone.mission.reader import read_mission_bytes
from mission_control.behavior import Behavior
from mission_control.laboratory.experiments.intervals import wilson
from mission_control.laboratory.harness import Progress, run_all
from mission_control.laboratory.simulation.whole_mission import RunningMission, mission_in_one_process
from mission_control.messages import BehaviorStatus
from resource_pool.localization import AskPose, Pose

ROOM_M = (6.0, 8.0)
BOARD_M = (5.5, 4.0)  # chosen: faces the room's length, with space for every start
STOP_M = 0.45  # mission_control.vision.servo_law.STOP_M
NEAREST_M, FARTHEST_M = 1.0, 2.5
OFF_AXIS_RAD = math.radians(45.0)
WITHIN_M, WITHIN_RAD = 0.05, math.radians(10.0)
LIMIT_S = 180.0  # chosen: four times what the usual approach takes
LOOKED_AT_EVERY_S = 0.5  # chosen: the resolution of a trial's end
COMES_TO_REST_S = 1.0  # chosen: a stopped body sways for less
ROBOT, SERVO, WORLD = "scout1", "servo", "world"

_MISSION = f"""<?xml version="1.0" encoding="UTF-8"?>
<mission name="servoing" priority="10">
  <resources>
    <resource type="command_radio" name="radio" sharable="true" capacity="1.0" driver="simulated"/>
    <resource type="video_frequency" name="video1" connect-s="0.3" driver="simulated"/>
    <resource type="framegrabber" name="grabber" driver="simulated">
      <uses type="video_frequency" name="video1"/>
      <parameter name="frame_rate_hz" value="30"/>
    </resource>
    <resource type="scout" name="{ROBOT}" features="camera" driver="simulated">
      <uses type="command_radio" name="radio"/>
      <uses type="video_frequency" name="video1"/>
      <parameter name="network_id" value="1"/>
    </resource>
  </resources>
  <world name="{WORLD}" type="simulated_world" host="base">
    <room width-m="{ROOM_M[0]:g}" depth-m="{ROOM_M[1]:g}"/>
    <landmark name="board" x-m="{BOARD_M[0]:g}" y-m="{BOARD_M[1]:g}" heading-deg="180"/>
    <robot name="{ROBOT}" x-m="3" y-m="4" heading-deg="0"/>
  </world>
  <behaviors>
    <behavior type="servo_to_target" name="{SERVO}" priority="1">
      <parameter name="stop_m" value="{STOP_M:g}"/>
      <arc kind="capture" minimum-runtime-s="10" period-s="0.033" packet-time-s="0.002">
        <wish type="scout" name="{ROBOT}"/>
      </arc>
    </behavior>
  </behaviors>
</mission>
"""


@dataclass(frozen=True, slots=True)
class TrialStart:
    """The start of a trial.

    Attributes:
        range_m: Distance from the board.
        off_axis_rad: Angle off its zero-angle line; left, seen from the board, is positive.
        x_m: In the room.
        y_m: In the room.
        heading_rad: In the room.
    """

    range_m: float
    off_axis_rad: float
    x_m: float
    y_m: float
    heading_rad: float
    world_seed: int


@dataclass(frozen=True, slots=True)
class ServoOrder:
    """The input of a trial: seed of the experiment, number and noise."""

    seed: int
    number: int
    noise: float


class ServoTrial(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The result of one trial.

    Attributes:
        number: Number of the trial, from 0.
        range_m: Distance from the board, at the start.
        off_axis_deg: Angle off the line, at the start.
        says_arrived: True if the behavior succeeded.
        off_m: Final distance of the robot from its goal.
        off_deg: Final angle between the robot's heading and the board.
        took_s: Time from bring-up to its end, or to the limit.
        approaches: Number of approaches.
        acquisitions: Number of acquisitions of the target.
    """

    number: int
    range_m: float
    off_axis_deg: float
    says_arrived: bool
    off_m: float
    off_deg: float
    took_s: float
    approaches: int
    acquisitions: int

    @property
    def succeeded(self) -> bool:
        """True if the robot ended at its goal and the behavior succeeded."""
        return self.says_arrived and self.off_m <= WITHIN_M and abs(self.off_deg) <= math.degrees(WITHIN_RAD)


@dataclass(frozen=True, slots=True)
class ServoOutcome:
    """The result of the experiment; the same seed gives the same result except ``wall_s``."""

    seed: int
    noise: float
    trials: tuple[ServoTrial, ...]
    wall_s: float

    @property
    def succeeded(self) -> int:
        """Number of trials that succeeded."""
        return sum(trial.succeeded for trial in self.trials)

    @property
    def simulated_s(self) -> float:
        """Mission time of all trials."""
        return sum(trial.took_s for trial in self.trials)

    def to_json(self) -> dict[str, object]:
        """Return it as plain data: ``conditions`` with one entry, ``seed``, ``wall_s``, ``simulated_s``."""
        count = len(self.trials)
        condition = {
            "noise": self.noise,
            "trials": count,
            "succeeded": self.succeeded,
            "rate": self.succeeded / count,
            "interval95": list(wilson(self.succeeded, count)),
            "median_s": median(trial.took_s for trial in self.trials),
            "median_off_m": median(trial.off_m for trial in self.trials),
            "approached_again": sum(trial.approaches > 1 for trial in self.trials),
            "failed": [msgspec.to_builtins(trial) for trial in self.trials if not trial.succeeded],
        }
        return {
            "conditions": [condition],
            "seed": self.seed,
            "wall_s": self.wall_s,
            "simulated_s": self.simulated_s,
        }


def draw(seed: int, number: int) -> TrialStart:
    """Return the start of this trial: the same for the same arguments, whatever the noise."""
    dice = Random(f"{seed} servoing {number}")
    range_m, off_axis_rad = dice.uniform(NEAREST_M, FARTHEST_M), dice.uniform(-OFF_AXIS_RAD, OFF_AXIS_RAD)
    x_m, y_m = BOARD_M[0] - range_m * math.cos(off_axis_rad), BOARD_M[1] + range_m * math.sin(off_axis_rad)
    return TrialStart(range_m, off_axis_rad, x_m, y_m, dice.uniform(-math.pi, math.pi), dice.randrange(2**31))


def run_servoing(
    *, trials: int, seed: int, noise: float, jobs: int = 0, progress: Progress | None = None
) -> ServoOutcome:
    """Run the trials.

    Args:
        trials: Number of trials, at least 1.
        seed: Seed of the experiment; the same seed gives the same result with any number of jobs.
        noise: Noise of the pictures: 0 none, 1 as in the papers, at most 10.
        jobs: Processes; 0: one a core.
    """
    began_s = time.monotonic()
    orders = [ServoOrder(seed, number, noise) for number in range(trials)]
    return ServoOutcome(
        seed, noise, tuple(run_all(run_trial, orders, jobs=jobs, progress=progress)), time.monotonic() - began_s
    )


def run_trial(order: ServoOrder) -> ServoTrial:
    """Run one trial to the behavior's end, or to ``LIMIT_S``."""
    return run_virtual(_play(order))


async def _play(order: ServoOrder) -> ServoTrial:
    start = draw(order.seed, order.number)
    async with mission_in_one_process(_mission_from(start, order.noise)) as running:
        behavior = running.component(SERVO)
        assert isinstance(behavior, Behavior)  # noqa: S101  the mission file names this class
        while not behavior.status.is_final and running.clock.now_s() < LIMIT_S:
            await running.clock.sleep_s(LOOKED_AT_EVERY_S)
        took_s, counts = running.clock.now_s(), behavior.statistics()
        await running.clock.sleep_s(COMES_TO_REST_S)
        at = await _pose(running)
    return ServoTrial(
        number=order.number,
        range_m=start.range_m,
        off_axis_deg=math.degrees(start.off_axis_rad),
        says_arrived=behavior.status is BehaviorStatus.SUCCESS,
        off_m=math.hypot(at.x_m - (BOARD_M[0] - STOP_M), at.y_m - BOARD_M[1]),
        off_deg=math.degrees(at.heading_rad),
        took_s=took_s,
        approaches=int(counts["approaches"]),
        acquisitions=int(counts["acquisitions"]),
    )


async def _pose(running: RunningMission) -> Pose:
    return await running.bus.ask(f"resource_pool/{WORLD}", AskPose(ROBOT), Pose, within_s=1.0)


def mission_text() -> str:
    """Return the mission file of all trials, with the robot in the middle of the starts."""
    return _MISSION


@lru_cache(maxsize=1)
def _mission() -> MissionDescription:
    return read_mission_bytes(mission_text().encode(), "servoing.xml")


def _mission_from(start: TrialStart, noise: float) -> MissionDescription:
    mission = _mission()
    (world,) = mission.components
    content = dict(world.parameters[WORLD])
    content |= {"seed": start.world_seed, "air": {"noise": noise}}
    (scout,) = content["robots"]
    content["robots"] = [{**scout, "x_m": start.x_m, "y_m": start.y_m, "heading_rad": start.heading_rad}]
    there = msgspec.structs.replace(world, parameters={**world.parameters, WORLD: content})
    return msgspec.structs.replace(mission, components=(there,))
