"""One trial of the surveillance experiment: a whole mission on a virtual clock, with a target that passes."""

from __future__ import annotations

import asyncio
import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from random import Random

import msgspec

from backbone.bus.clock import run_virtual
from backbone.keys import Conversation
from backbone.mission.behavior_orders import behavior_orders
from backbone.naming import Subsystem, address
from backbone.placer.messages import Start
from backbone.scheduling.trace import Line
from backbone.waiting import first_of
from backbone.wire import Envelope
from mission_control.laboratory.experiments.audit import Transmitting, agreement
from mission_control.laboratory.experiments.conditions import Condition
from mission_control.laboratory.experiments.geometry import FRAMES_PER_S, SETTLING_S, WATCHERS, is_in_view
from mission_control.laboratory.experiments.mission_file import (
    MISSION_PRIORITY,
    PACKET_TIME_S,
    PERIOD_S,
    WORLD,
    mission_of_trial,
    watcher_of,
)
from mission_control.laboratory.experiments.operator import SimulatedOperator
from mission_control.laboratory.experiments.prediction import departs_s
from mission_control.laboratory.simulation.whole_mission import RunningMission, mission_in_one_process
from mission_control.messages import MotionSeen
from resource_pool.drivers.world_messages import WorldState

CLAIMS_FROM_FRAME = 15  # chosen: half a second in which the Scouts come to rest on the floor
AFTERWARDS_S = 0.5  # chosen: longer than the delay of a picture


class Trial(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The result of one trial.

    Attributes:
        number: Number of the trial, from 0.
        detected: True if a watcher published motion while the target was in its view.
        false_alarms: Number of motion events published while the target was not in the watcher's view.
        switches: Grants and ends of holds compared with the transmitters.
        disagreements: Disagreements, one line each.
        jammed_frames: Frames with two transmitters on one frequency.
        stale_packets: Packets of stale epochs on the air.
        simulated_s: Its mission time.
        digest: Hash of all decisions of the RC manager and all events.
    """

    number: int
    detected: bool
    false_alarms: int
    switches: int
    disagreements: list[str]
    jammed_frames: int
    stale_packets: int
    simulated_s: float
    digest: str


@dataclass(frozen=True, slots=True)
class Draw:
    """The random values of a trial.

    Attributes:
        first: Number of the claimant with the first slice.
        departs_frame: Frames from the first connection to the target's departure.
        world_seed: Seed of the world and its air.
    """

    first: int
    departs_frame: int
    world_seed: int


def draw(condition: Condition, seed: int, number: int) -> Draw:
    """Return the random values of this trial: the same for the same arguments.

    The phase between the target's departure and the schedule is uniform over a round. If all slices are equal and share
    one frequency, the choice of the first claimant makes the whole turns of the phase, and a wait makes the rest.
    Otherwise the wait makes the whole phase, after the first turn of every claimant.
    """
    dice = Random(f"{seed} trial {number}")
    phase, world_seed = dice.random(), dice.randrange(2**31)
    if condition.channels == 1 and condition.policy == "paper":
        turn = phase * len(condition.robots)
        turn_s = condition.slice_s + SETTLING_S
        return Draw(int(turn), round(turn % 1.0 * turn_s * FRAMES_PER_S), world_seed)
    return Draw(0, round(departs_s(condition, phase) * FRAMES_PER_S), world_seed)


def run_trial(
    condition: Condition, seed: int, number: int, *, to_the_end: bool = False, trace: Path | None = None
) -> Trial:
    """Run one trial from its beginning to the detection, or until the target has passed.

    Args:
        to_the_end: True: the trial continues after the detection.
        trace: File for its schedule trace, JSON lines.
    """
    result, lines = run_virtual(_Trial(condition, seed, number, to_the_end=to_the_end).run())
    if trace is not None:
        end = {"ev": "end", "t": result.simulated_s}
        trace.write_text("".join(f"{json.dumps(line)}\n" for line in (*lines, end)), encoding="utf-8")
    return result


class _Trial:
    def __init__(self, condition: Condition, seed: int, number: int, *, to_the_end: bool) -> None:
        self._condition, self._number, self._to_the_end = condition, number, to_the_end
        self._draw = draw(condition, seed, number)
        self._departs_s = (CLAIMS_FROM_FRAME + self._draw.departs_frame) / FRAMES_PER_S
        self._mission = mission_of_trial(condition, self._draw.world_seed, self._departs_s)
        self._places = dict(zip(condition.watching, WATCHERS, strict=False))
        self._world_began_s = 0.0
        self._frame = 0
        self._samples: list[Transmitting] = []
        self._seen: list[tuple[float, str, bool]] = []
        self._waits_for: tuple[int, asyncio.Event] | None = None
        self._requested: dict[str, asyncio.Event] = {}
        self._detected = asyncio.Event()

    async def run(self) -> tuple[Trial, list[Line]]:
        bare = msgspec.structs.replace(self._mission, behaviors=())
        consoles = {"operator": SimulatedOperator}
        async with mission_in_one_process(bare, trace=self._decided, consoles=consoles) as running:
            running.bus.subscribe(
                address(Subsystem.RESOURCE_POOL, WORLD), Conversation.BODIES, WorldState, self._world_moved
            )
            running.bus.subscribe(f"{Subsystem.MISSION_CONTROL}/*", Conversation.EVENTS, MotionSeen, self._motion_seen)
            await self._frame_number(CLAIMS_FROM_FRAME)
            await self._claim(running)
            await self._until_passed_or_detected()
            over_s = running.clock.now_s()
            world = await running.statistics(WORLD)
            lines = list(running.trace)
        return self._judge(lines, world, over_s), lines

    async def _claim(self, running: RunningMission) -> None:
        """Let watchers and consoles claim in order, each after the previous one's request."""
        condition = self._condition
        watchers = {order.name: order for order in behavior_orders(self._mission)}
        turns = condition.in_turn
        for place in range(len(turns)):
            robot = turns[(self._draw.first + place) % len(turns)]
            if robot in condition.watching:
                order, arc = self._watcher(watchers[watcher_of(robot)]), f"{watcher_of(robot)}-capture"
            else:
                order, arc = self._console(robot), f"console-{robot}-video_drive"
            asked = self._requested[arc] = asyncio.Event()
            await running.start(order)
            await asked.wait()

    def _watcher(self, order: Start) -> Start:
        return msgspec.structs.replace(order, parameters={**order.parameters, "seed": self._draw.world_seed})

    def _console(self, robot: str) -> Start:
        condition = self._condition
        parameters = {
            "robot": robot,
            "priority": MISSION_PRIORITY,
            "minimum_runtime_s": condition.console_slice_s,
            "period_s": PERIOD_S,
            "packet_time_s": PACKET_TIME_S,
            "driven": condition.driven,
            "yields": condition.policy == "adaptive",
            "seed": self._draw.world_seed + int(robot.removeprefix("scout")),
        }
        return Start("operator", f"console-{robot}", parameters)

    async def _until_passed_or_detected(self) -> None:
        passed = self._departs_s + self._condition.passage.lasts_s + AFTERWARDS_S
        await first_of(self._frame_number(round(passed * FRAMES_PER_S)), self._detected.wait())

    async def _frame_number(self, number: int) -> None:
        """Wait until the world has published this frame."""
        if self._frame < number:
            event = asyncio.Event()
            self._waits_for = number, event
            await event.wait()

    def _decided(self, line: Line) -> None:
        if line["ev"] == "request" and line["arc"] in self._requested:
            self._requested[line["arc"]].set()

    def _world_moved(self, envelope: Envelope[WorldState]) -> None:
        state = envelope.body
        self._frame, self._world_began_s = state.frame, state.at_s - state.frame / FRAMES_PER_S
        if not self._samples or self._samples[-1].on != state.transmitting:
            self._samples.append(Transmitting(state.at_s, dict(state.transmitting)))
        if self._waits_for is not None and state.frame >= self._waits_for[0]:
            self._waits_for[1].set()
            self._waits_for = None

    def _motion_seen(self, envelope: Envelope[MotionSeen]) -> None:
        seen = envelope.body
        since_s = seen.at_s - self._world_began_s - self._departs_s
        is_true = is_in_view(self._condition.passage, self._places[seen.robot], since_s)
        self._seen.append((since_s, seen.robot, is_true))
        if is_true and not self._to_the_end:
            self._detected.set()

    def _judge(self, trace: list[Line], world: dict[str, float], over_s: float) -> Trial:
        frequencies = [f"video{channel}" for channel in range(1, self._condition.channels + 1)]
        agreed = agreement(trace, self._samples, self._condition.robots, frequencies, over_s)
        true = sum(is_true for _since_s, _robot, is_true in self._seen)
        everything = json.dumps([trace, self._seen], sort_keys=True)
        return Trial(
            number=self._number,
            detected=true > 0,
            false_alarms=len(self._seen) - true,
            switches=agreed.switches,
            disagreements=list(agreed.broken),
            jammed_frames=agreed.jammed + int(world["jammed_frames"]),
            stale_packets=int(world["stale_packets"]),
            simulated_s=over_s,
            digest=hashlib.sha256(everything.encode()).hexdigest(),
        )
