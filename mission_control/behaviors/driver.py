"""Driver: base class of behaviors that drive a robot. This file has the loop; the decisions are in pure files."""

from __future__ import annotations

import logging
import math
from typing import ClassVar, TypeVar

from backbone.errors import LinkError, Refusal, code_of
from backbone.naming import Subsystem, address
from backbone.wire import UnknownMessage
from mission_control.behavior import Behavior, BehaviorParameters
from mission_control.behaviors.motion import FloorPoint, Motion, Position
from mission_control.messages import BehaviorStatus
from resource_pool.arc_client import (
    ArcClient,
    AskFloorPlan,
    AskHome,
    AskPose,
    EmergencyStopped,
    FloorPlan,
    NoSuchAction,
    Pose,
    SwappedOut,
)

log = logging.getLogger(__name__)

DECIDE_EVERY_S = 0.1  # chosen: commands expire after half a second; ten a second of 2 ms use a fiftieth of a radio
LOCALIZE_WITHIN_S = 0.3  # chosen: an older position is useless for steering; wheels stop by themselves after 0.5 s
LOST_M = 5.0  # chosen: half a room; with less spread, driving on is still useful
LOST_RAD = math.radians(100.0)  # chosen: with more spread it may drive in a wrong direction; one jump causes less
AGAIN_AFTER_S = 1.0  # chosen: hardware needs a moment after a refusal; mission seconds

D = TypeVar("D", bound=BehaviorParameters)


class Lost(Refusal):
    """The localizer's estimate of the robot's place or heading is too uncertain for driving."""

    code = "behavior.lost"
    remedy = "Bring a landmark into the robot's view, or take the robot over and check where it is."


class NeedsArc(Refusal):
    """A driving behavior has no ARC."""

    code = "behavior.needs_arc"
    remedy = "Give the behavior an <arc> of the kind this behavior's documentation names."


class Driver(Behavior[D]):
    """Drives during grants, stops the robot before the end of a grant, and fails if it never can drive.

    Derive, override ``drive_on`` instead of ``act``, and keep all progress on ``self`` or in a plain object there.
    """

    needs_arc = "drive"
    never: ClassVar[frozenset[str]] = frozenset({"world.unknown_body", "localizer.unknown_body", "wire.unknown"})
    """Codes of permanent refusals: a retry would fail again."""
    spread_m = 0.0
    """Standard deviation of the place in the localizer's last answer."""
    is_driving = False
    """True while ``drive_on`` runs; at all other times the robot obeys no decision of the behavior."""

    async def drive_on(self, robot: str) -> None:
        """Continue the work.

        When: from each ``resumed`` on; cancelled before the end of the grant, and begun again later.
        What: decide, ``move``, sleep ``DECIDE_EVERY_S``, in a loop. Not: keep progress in local variables.
        """
        raise NotImplementedError

    def interrupted(self) -> None:
        """Forget the last motion.

        When: before each ``drive_on``: at the begin of a grant, and after an operator's stop, a cut link or a refusal.
        What: take into account that the robot stood still until now, and that a person may have moved it. Not: send
        commands.
        """

    @property
    def held(self) -> ArcClient:
        """The client of its ARC.

        Raises:
            NeedsArc: The behavior claims no ARC.
        """
        if self.arc is None:
            raise NeedsArc(f"{self.name} has no ARC; it needs one like {self.needs_arc!r}")
        return self.arc

    async def move(self, motion: Motion) -> None:
        """Move at these speeds until the next call, for at most half a second."""
        await self.held.move(motion.forward_m_s, motion.turn_rad_s)

    async def halted(self, given: BehaviorParameters) -> bool:
        """Stop the robot; return False if its parameters are no longer these, so that the work is not over."""
        await self.held.halt()
        return given is self.parameters

    async def locate(self, localizer: str, robot: str) -> Position:
        """Return the localizer's estimate of the position of the robot or another body.

        Args:
            localizer: Name or address of the tracking component.

        Raises:
            Lost: The estimate is too uncertain.
            Refusal: The localizer does not know the body, or the component is not a localizer.
            LinkError: The localizer did not answer.
        """
        pose = await self._ask_localizer(localizer, AskPose(robot))
        self.spread_m = pose.spread_m
        if pose.spread_m > LOST_M or pose.spread_rad > LOST_RAD:
            spread = f"{pose.spread_m:.1f} m and {math.degrees(pose.spread_rad):.0f}°"
            raise Lost(f"{localizer} does not know where {robot} is: the spread is {spread}")
        return Position(pose.x_m, pose.y_m, pose.heading_rad)

    async def locate_home(self, localizer: str, robot: str) -> FloorPoint:
        """Return the robot's first known position; raises as ``locate``."""
        home = await self._ask_localizer(localizer, AskHome(robot))
        return FloorPoint(home.x_m, home.y_m)

    async def room(self, localizer: str) -> FloorPlan | None:
        """Return the plan of the floor; None: the localizer has no plan; raises ``LinkError`` as ``locate``."""
        try:
            return await self.bus.ask(_tracker(localizer), AskFloorPlan(), FloorPlan, within_s=LOCALIZE_WITHIN_S)
        except UnknownMessage:
            return None

    async def _ask_localizer(self, localizer: str, question: AskPose | AskHome) -> Pose:
        return await self.bus.ask(_tracker(localizer), question, Pose, within_s=LOCALIZE_WITHIN_S)

    async def start(self) -> None:
        """Fail at once without an ARC; see ``BehaviorHooks.start``."""
        if self.parameters.arc is None:
            self.give_up(NeedsArc(f"{self.name} has no ARC; it needs one like {self.needs_arc!r}"))

    async def act(self) -> None:
        """Drive; after a permanent refusal fail, after other refusals retry."""
        while True:
            self.interrupted()
            self.is_driving = True
            try:
                return await self.drive_on(self.robot)
            except (SwappedOut, EmergencyStopped):
                raise
            except LinkError as error:
                self.report(f"stands: {error}")
                raise
            except Refusal as refusal:
                if isinstance(refusal, NoSuchAction) or code_of(refusal) in self.never:
                    self.give_up(refusal)
                    return None
                self.report(f"stands: {refusal}")
            finally:
                self.is_driving = False
            await self.clock.sleep_s(AGAIN_AFTER_S)

    async def suspending(self, deadline_s: float) -> None:  # noqa: ARG002  a halt takes only milliseconds
        """Bring the robot to rest."""
        try:
            await self.held.halt()
        except (Refusal, LinkError) as error:  # the radio's last packet also stops the robot
            log.info("%s could not be halted: %s", self.name, error)

    def give_up(self, refusal: Refusal) -> None:
        """Fail; the parent gets the refusal's code, detail and remedy."""
        why: dict[str, object] = {"code": code_of(refusal), "detail": refusal.detail, "remedy": refusal.remedy}
        self.report(f"gives up: {refusal.detail}")
        self.finish(BehaviorStatus.FAILURE, why)


def _tracker(localizer: str) -> str:
    return localizer if "/" in localizer else address(Subsystem.RESOURCE_POOL, localizer)
