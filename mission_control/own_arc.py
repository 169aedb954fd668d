"""OwnArc: a behavior's claim of its ARC, and the ARC's grants.

Rule of this file: only the behavior in charge claims the ARC and acts. A second implementation gets the notices of
grants, too, so that it can continue under the same grant.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping

import msgspec

from backbone.component.messages import Absence
from backbone.errors import LinkError, Refusal
from backbone.mission.behavior_nodes import ArcNeed
from backbone.reading_anew import WrongClass
from backbone.wire import Envelope, Message
from mission_control.acting import Acting, cancel
from mission_control.behavior_hooks import BehaviorHooks, suspended_because
from mission_control.behavior_of_parts import BehaviorOfParts
from mission_control.child_keeper import AGAIN_AFTER_S, START_PATIENCE_S, end_task, why
from mission_control.messages import BehaviorStatus
from resource_pool.arc_client import (
    ArcClient,
    Frame,
    Noted,
    NotMyArc,
    PathNode,
    Resumed,
    Suspended,
    Suspending,
    Usage,
    arc_name,
    claim_parameters,
)

log = logging.getLogger(__name__)

REST_S = 0.5  # chosen: as at the end of a slice; stopping needs one command
NO_GRANT_YET = "no grant yet"


class OwnArc:
    """Claims the ARC, keeps it, calls the hooks at the begin and end of grants, and releases it; an ``ArcListener``.

    Args:
        owner: The behavior.
        hooks: Its hooks; the same behavior.

    Attributes:
        client: The client of the ARC; None without an ARC.
        claimed: The need for which the ARC is claimed; None: not yet claimed.
        rcs: Role → name of the granted RCs; empty while suspended.
        robot: The granted RC that has a body; empty while suspended, and without one.
        suspended_because: Why there is no grant, as part of a sentence.
        acting: The task in which the behavior uses the grant.
    """

    def __init__(self, owner: BehaviorOfParts, hooks: BehaviorHooks) -> None:
        self.client: ArcClient | None = None
        self.claimed: ArcNeed | None = None
        self.rcs: Mapping[str, str] = {}
        self.robot = self.suspended_because = ""
        self.acting = Acting(owner, hooks)
        self._owner, self._hooks, self._gate, self._clock = owner, hooks, owner.gate, owner.clock
        self._times_resumed = self._times_suspended = self._frames_seen = 0
        self._has_other_times = False
        self._claim: dict[str, object] = {}
        self._keeping: asyncio.Task[None] | None = None

    async def begin(self, need: ArcNeed, beside: OwnArc | None) -> None:
        """Claim the ARC; if another implementation is in charge, only follow its grants."""
        self.client = ArcClient(self._gate, arc_name(self._gate, need.kind), self, self._hooks.not_now)
        self.client.frames(self._saw)
        if beside is None:
            self.suspended_because = NO_GRANT_YET
            self._begin_keeping(self.client, need)
        elif beside.client is not None and beside.client.granted is not None:
            await self.client.handle(beside.client.granted)

    async def answer(self, asked: Envelope[Message]) -> Noted:
        """Answer a notice of the ARC; see ``ArcClient.answer``.

        Raises:
            NotMyArc: No ARC is claimed, or the notice comes from another one.
        """
        if self.client is None:
            raise NotMyArc(f"{self._owner.name} claims no ARC")
        return await self.client.answer(asked)

    def claim_as_now(self, need: ArcNeed | None) -> None:
        """Use the owner's present path and, if it is given, this need for the next claim."""
        if self.claimed is not None:
            self.claimed = need or self.claimed
            self._claim.update(self._claim_of(self.claimed))

    async def release(self) -> None:
        """Release the ARC; return when it is released, or has another owner."""
        keeping, self._keeping = self._keeping, None
        if keeping is None or self.client is None:
            return None
        await end_task(keeping)
        self._owner.changed()
        while True:
            try:
                return await self.client.release(f"{self._owner.name} is done")
            except LinkError as error:
                log.info("%s: released without an answer: %s", self.client.arc, error)
            except Refusal as refusal:  # the ARC has another owner by now
                log.info("%s is not released: %s", self.client.arc, refusal)
                return None
            await self._clock.sleep_s(AGAIN_AFTER_S * self._clock.rate)

    def absence(self) -> Absence | None:
        """Return the ARC, if it is wanted and missing."""
        return self.client.wish.absence() if self.client is not None and self._keeping is not None else None

    def statistics(self) -> dict[str, float]:
        """Return counts of grants and pictures."""
        return {
            "times_resumed": self._times_resumed,
            "times_suspended": self._times_suspended,
            "frames_seen": self._frames_seen,
        }

    def _claim_of(self, need: ArcNeed) -> dict[str, object]:
        return claim_parameters(
            self._owner.address,
            path=[PathNode(name, priority) for name, priority in self._owner.path],
            minimum_runtime_s=need.minimum_runtime_s,
            maximum_runtime_s=need.maximum_runtime_s,
            wish=need.wish,
            features={role: list(names) for role, names in need.features.items()},
            usage=Usage(need.period_s, need.packet_time_s, kind=need.kind),
            stops_at_once=self._commands_nothing,
            may_say_not_now=type(self._hooks).not_now is not BehaviorHooks.not_now,
            console=self._owner.is_ordered,
        )

    @property
    def _commands_nothing(self) -> bool:
        """True if the behavior sends no commands, because it overrides neither ``act`` nor ``suspending``."""
        kind = type(self._hooks)
        return kind.act is BehaviorHooks.act and kind.suspending is BehaviorHooks.suspending

    def _begin_keeping(self, arc: ArcClient, need: ArcNeed, *, is_there: bool = False) -> None:
        self._keeping = self._owner.begin_task(self._keep(arc, need, is_there), "arc")

    async def _keep(self, arc: ArcClient, need: ArcNeed, is_there: bool) -> None:
        self.claimed, self._claim = need, self._claim_of(need)
        patience_s, changed = START_PATIENCE_S, self._owner.changed
        try:
            if self._has_other_times:
                self._has_other_times = False
                await self._want_times(arc, need)
            await arc.keep(
                self._clock, need.kind, self._claim, patience_s=patience_s, on_changed=changed, is_there=is_there
            )
        except Refusal as refusal:
            self._owner.report(f"no ARC: {refusal}")
            self._owner.finish(BehaviorStatus.FAILURE, why(refusal))

    async def _want_times(self, arc: ArcClient, need: ArcNeed) -> None:
        try:
            await arc.want_runtime(need.minimum_runtime_s, need.maximum_runtime_s)
        except (Refusal, LinkError) as error:  # the last class's parameters stay until the next claim
            self._owner.story.note(arc.arc, f"its run times were not changed: {error}")

    def go_on_from(self, other: OwnArc) -> None:
        """Take over the claim and the counts of another implementation."""
        self.claimed = self.claimed or other.claimed
        self._times_resumed, self._times_suspended = other._times_resumed, other._times_suspended
        self._frames_seen = other._frames_seen

    def compare(self, need: ArcNeed | None, other: OwnArc) -> None:
        """Record how the present claim must change when this owner takes charge.

        Raises:
            WrongClass: The owner needs another ARC.
        """
        had, same = other.claimed, need
        if had is not None and need is not None:
            times = need.minimum_runtime_s, need.maximum_runtime_s
            same = msgspec.structs.replace(had, minimum_runtime_s=times[0], maximum_runtime_s=times[1])
        if (had is None) != (need is None) or need != same:
            raise WrongClass(
                f"{self._owner.name} would need another ARC than now", remedy="Ask for the ARC of the tree."
            )
        self.claimed, self._has_other_times = need, need != had
        self.suspended_because = other.suspended_because

    def take_charge(self) -> None:
        """Keep the ARC and act from now on."""
        if self.client is not None and self.claimed is not None and self._keeping is None:
            self._begin_keeping(self.client, self.claimed, is_there=True)
        if self.client is not None and self.rcs and not self._owner.status.is_final and not self.acting.is_under_way:
            self.acting.begin(self.client)

    def stand_by(self) -> None:
        """Stop keeping and acting; the ARC stays with the component."""
        keeping, self._keeping = self._keeping, None
        cancel(keeping)
        self.acting.drop()

    async def arc_resumed(self, notice: Resumed) -> None:
        """Call the hooks; see ``ArcListener``."""
        owner = self._owner
        self.rcs, self.robot, self.suspended_because = notice.rcs, notice.robot, ""
        self._times_resumed += 1
        held = ", ".join(f"{kind} {name}" for kind, name in notice.rcs.items())
        owner.story.note(owner.name, f"resumed with {held}")
        owner.report(f"holds {held}")
        owner.suspension_changed()
        self.acting.resumes_again = False
        try:
            await self._hooks.resumed(notice.rcs)
        except (Refusal, LinkError) as error:  # it is not in charge, or there is an obstacle, which ``acting`` handles
            log.info("%s is resumed again before it acts: %s", owner.name, error)
            self.acting.resumes_again = True
        if self.client is not None and self.rcs and not owner.status.is_final and self._gate.is_open:
            await self.acting.stop()
            self.acting.begin(self.client)

    async def arc_suspending(self, notice: Suspending) -> None:
        """Call the hooks; see ``ArcListener``."""
        await self.acting.stop()
        await self._hooks.suspending(notice.deadline_s)

    async def arc_suspended(self, notice: Suspended) -> None:
        """Call the hooks; see ``ArcListener``."""
        owner = self._owner
        self.rcs, self.robot = {}, ""
        self.suspended_because = suspended_because(notice.reason, notice.by)
        self._times_suspended += 1
        owner.story.note(owner.name, f"suspended: {self.suspended_because}")
        owner.report(f"suspended: {self.suspended_because}")
        owner.suspension_changed()
        await self.acting.stop()
        await self._hooks.suspended(notice.reason, notice.by)
        owner.keep_memory()

    async def rest(self) -> None:
        """Bring the robot to rest, if the owner commands one; the grant continues."""
        if self.rcs and not self._commands_nothing:
            try:
                await self._hooks.suspending(REST_S)
            except (Refusal, LinkError) as error:  # the grant ended first, or an operator stopped the robot
                log.info("%s did not bring its robot to rest: %s", self._owner.name, error)

    def _saw(self, frame: Frame) -> None:
        if self.rcs and not self._owner.status.is_final:
            self._frames_seen += 1
            self._hooks.see(frame)
