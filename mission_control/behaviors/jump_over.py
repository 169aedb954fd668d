"""Jump over: bring a robot to the other side of a box, a step or a wall of up to 30 cm.

The way to the obstacle must be free, and a localizer must track the robot: see ``patrol``.

In mission.xml: an ARC of kind ``drive`` (or more), and the localizer's name. Set the maximum run time of the ARC a few
seconds above its minimum, so that no slice ends while the robot is in the air.

Source: IROS 2001, section 2: the Scout jumps over objects 30 cm in height.
"""

from __future__ import annotations

import math
from typing import Annotated

from msgspec import Meta, Struct

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.ranges import Measure
from backbone.wire import Message
from mission_control.behavior import BehaviorParameters
from mission_control.behavior_hooks import suspended_because
from mission_control.behaviors.driver import DECIDE_EVERY_S, Driver
from mission_control.behaviors.jump_course import DEEPEST_M, Act, JumpCourse, JumpStage, Obstacle
from mission_control.behaviors.motion import FARTHEST_M, Attempts, DrivingSpeed, Motion, NamedLocalizer, read_places
from mission_control.messages import BehaviorStatus
from resource_pool.arc_client import Jump, word_of


class JumpOverParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``JumpOver``.

    Attributes:
        front: Point of the obstacle's near side to cross: ``x,y`` in meters.
        heading_deg: Direction of the jump: 0 along x, 90 along y.
        localizer: Component that tracks robots: its name if it is in the resource pool, else its address.
        depth_m: Depth of the obstacle in that direction.
        onward_m: Distance to drive beyond the obstacle.
        speed_m_s: Speed on straight ways.
        attempts: Number of jumps after which it fails.
    """

    front: str
    heading_deg: Measure
    localizer: NamedLocalizer
    depth_m: Annotated[float, Meta(gt=0, le=DEEPEST_M)] = 0.1
    onward_m: Annotated[float, Meta(ge=0, le=FARTHEST_M)] = 0.5
    speed_m_s: DrivingSpeed = 0.2
    attempts: Attempts = 5

    def __post_init__(self) -> None:
        if len(read_places(self.front)) != 1:
            raise ValueError(f"front is {self.front!r}: write one place, x,y in meters")


class JumpMemory(Struct, frozen=True):
    """Jumps of a robot.

    Attributes:
        number: Number of jumps that the robot obeyed.
        last_s: Mission time of the last one that was decided.
    """

    number: int
    last_s: float


class JumpOver(Driver[JumpOverParameters]):
    """Succeeds when the robot has driven on beyond the obstacle; fails after ``attempts`` unsuccessful jumps."""

    parameters_type = JumpOverParameters
    hands_over = frozenset({"course"})
    memory_type = JumpMemory

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self.course = self._plan()
        """The state of the course."""

    async def drive_on(self, robot: str) -> None:
        """Decide ten times a second from the robot's position; see ``Driver.drive_on``."""
        while not (self.course.is_final and await self.halted(self.parameters)):
            position = await self.locate(self.parameters.localizer, robot)
            course = self.course
            match course.decide(position, self.clock.now_s()):
                case Motion() as motion:
                    await self.move(motion)
                case Act.JUMP:
                    self.keep_memory()  # the next process waits for the landing
                    await self.held.jump()
                    course.jumped()  # the robot may get another course meanwhile
                    self.keep_memory()
                    self.story.note(robot, f"jumps, number {course.jumps}")
                case Act.WAIT:
                    pass
            self.report(f"{robot} {self.course.stage}, {self.course.jumps} jumps")
            if not self.course.is_final:
                await self.clock.sleep_s(DECIDE_EVERY_S)
        is_over = self.course.stage is JumpStage.OVER
        self.finish(BehaviorStatus.SUCCESS if is_over else BehaviorStatus.FAILURE, {"jumps": self.course.jumps})

    def not_now(self) -> float:
        """Return the time until the robot has landed; see ``Behavior.not_now``."""
        return self.course.airborne_s(self.clock.now_s())

    def robot_obeyed(self, command: Message) -> None:
        """Wait for the landing of a jump that another class commanded; see ``Behavior.robot_obeyed``."""
        if word_of(command) == Jump.word():
            self.course.jumped_already(self.clock.now_s())

    def interrupted(self) -> None:
        """Decide next only from the robot's position; see ``Driver.interrupted``."""
        self.course.interrupt()

    async def suspended(self, reason: str, by: str) -> None:
        """Keep the state; after the suspension the next decision depends only on the robot's position."""
        self.report(f"suspended: {suspended_because(reason, by)}; {self.course.jumps} jumps until now")

    def memory(self) -> JumpMemory:
        """Return the jumps; see ``BehaviorHooks.memory``."""
        return JumpMemory(self.course.jumps, self.course.jumped_s)

    def recall(self, memory: JumpMemory) -> None:
        """Wait for the landing of the last jump, and judge it."""
        self.course.resume(memory.number, memory.last_s)

    def parameters_changed(self) -> None:
        """Begin again with the new parameters, after a present jump."""
        airborne_s, self.course = self.not_now(), self._plan()
        self.course.lands_in(airborne_s, self.clock.now_s())

    def statistics(self) -> dict[str, float]:
        """Return the base's counters and the jumps."""
        return {**super().statistics(), "jumps": self.course.jumps}

    def _plan(self) -> JumpCourse:
        given = self.parameters
        [front] = read_places(given.front)
        obstacle = Obstacle(front, math.radians(given.heading_deg), given.depth_m)
        return JumpCourse(obstacle, attempts=given.attempts, speed_m_s=given.speed_m_s, onward_m=given.onward_m)
