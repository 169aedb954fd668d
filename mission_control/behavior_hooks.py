"""Hooks of a behavior: all methods that your own behavior may override.

Each hook documents when it is called, its purpose, and what it must not do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import msgspec

from backbone.mission.behavior_nodes import ArcNeed
from backbone.mission.class_facts import ANY_ARC
from backbone.wire import Message
from mission_control.children import Children, Decision
from mission_control.messages import BehaviorStatus
from resource_pool.arc_client import Frame


class BehaviorHooks:
    """Hooks of a behavior: event handlers and decisions."""

    needs_arc: ClassVar[str] = ""
    """Kind of ARC like which the behavior needs one. A class that overrides ``see`` and sets no kind needs pictures;
    one that overrides ``act``, an ARC of any kind. Classes derived from one that sets ``""`` need none either."""
    _needs_none: ClassVar[bool] = False
    memory_type: ClassVar[type[msgspec.Struct] | None] = None
    """Class of the values that ``memory`` returns; None: a behavior that is killed begins anew."""

    def __init_subclass__(cls, **kwargs: object) -> None:
        super().__init_subclass__(**kwargs)
        if "needs_arc" in vars(cls):
            cls._needs_none = cls.needs_arc == ""
        elif not cls._needs_none and cls.needs_arc in ("", ANY_ARC):
            cls.needs_arc = "capture" if "see" in vars(cls) else ANY_ARC if "act" in vars(cls) else cls.needs_arc

    async def start(self) -> None:
        """Prepare.

        When: once, after readiness, before the claim of the ARC and the start of children.
        What: subscribe to events of other components, set up state. Not: wait for the ARC or for children.
        """

    def need(self) -> ArcNeed | None:
        """Return the ARC to claim.

        When: after ``start``, and after a change of its ARC in the tree. What: by default the ARC of the tree; a
        behavior that computes better run times returns the same need with its run times. Not: ask for another kind of
        ARC.
        """
        return None

    async def resumed(self, rcs: Mapping[str, str]) -> None:
        """Continue with the granted RCs.

        When: at the begin of each grant; commands pass and pictures arrive from now on. If a command in it fails, it is
        called again under the rules of ``act``, which follows.
        What: inform algorithms of the elapsed time. Not: drive in a loop; ``act`` is for that.

        Args:
            rcs: Role → name of the granted RCs.
        """

    async def act(self) -> None:
        """Command the robot.

        When: runs as a task from each ``resumed`` on; it is cancelled before ``suspending`` and ``suspended``.
        What: await ``self.arc`` commands and the clock, keep progress on ``self``. If a command is too late for the
        grant, the task ends without an error. After a ``LinkError`` or ``OutcomeUnknown`` it begins again; after an
        operator's stop it begins again when that stop is lifted.
        Not: catch the cancellation and continue; return without ``finish``, because the behavior then keeps
        its RCs; only a class that overrides ``see``, or a parent, may finish later.
        """

    async def suspending(self, deadline_s: float) -> None:
        """Stop cleanly.

        When: shortly before the end of a slice, except before an override by a human. A behavior that overrides neither
        this hook nor ``act`` is not called. Commands still pass.
        What: stop the robot, then return. Not: exceed the deadline.

        Args:
            deadline_s: Seconds left.
        """

    def is_ready(self) -> bool:
        """Return whether this implementation can replace the one in charge.

        When: repeatedly after ``start``, while it runs beside the other class (``scout-backbone swap``). What: True as
        soon as it has enough data, such as pictures. Not: wait.
        """
        return True

    def robot_obeyed(self, command: Message) -> None:
        """Take a command of another class into account.

        When: for each command of a new class during its trial (``scout-backbone swap``), because this class comes back
        if the trial fails; also for a command without an answer. What: record an effect that outlasts the command, such
        as a jump (``word_of`` returns the word of each command). Not: send commands.
        """

    def not_now(self) -> float:
        """Return the time that the behavior needs beyond the end of the slice.

        When: shortly before the end of the minimum run time and of each extension, if the maximum run time is longer
        and the behavior overrides this hook.
        What: return an estimate of the needed time, from known data. Not: wait; ask for spare time, because other ARCs
        wait for it; rely on it, because a higher behavior or a person still preempts.

        Returns:
            Seconds needed beyond the end of the slice; 0: the slice may end.
        """
        return 0.0

    async def suspended(self, reason: str, by: str) -> None:
        """Handle the end of a grant.

        When: after every loss of the RCs, even an unannounced one. What: keep the state, report it.
        Not: send commands; no picture arrives until ``resumed``.

        Args:
            reason: ``slice``, ``higher``, ``rc``, ``lost`` …
            by: The ARC or RC that caused it.
        """

    def see(self, frame: Frame) -> None:
        """Process a picture.

        When: for the newest picture of the present grant; older pictures are skipped.
        What: detect, publish, ``report``. Not: take longer than a picture's period, because it blocks the event loop.
        """

    def memory(self) -> msgspec.Struct | None:
        """Return the progress that the next process needs, if this one is killed.

        When: with each ``tell_parent`` and ``keep_memory``, and at the end of each grant, for classes that set
        ``memory_type``. What: few values that mean the same after a restart, such as counts. Not: what the robot does
        now; the next process gets it after an interruption.
        """
        return None

    def recall(self, memory: Any) -> None:
        """Continue from the progress of the last process.

        When: before ``start``, if the last process kept a memory under the same order, with the same parameters.

        Args:
            memory: A ``memory_type``, as ``memory`` returned it.
        """

    def rules(self, children: Sequence[str]) -> Children:
        """Return the rules by which children are started and judged.

        When: once, before ``start``; the parameters are known. What: by default, all run together or, with
        ``children_together`` False, one after the other; see ``composites`` for others. Not: start children or tasks.

        Args:
            children: Their names, in the order of the mission file.
        """
        raise NotImplementedError

    async def child_finished(self, child: str, status: BehaviorStatus, payload: Mapping[str, object]) -> Decision:
        """Decide what follows the end of a child.

        When: a child reported success or failure, was refused at its start, or crashed too often.
        What: return the decision; by default that of ``rules``: a failure aborts, a success continues. Not: start or
        stop children here.
        """
        raise NotImplementedError

    def children_arranged(self) -> None:
        """Report which children run.

        When: after each event of the children and each start and stop. What: by default, nothing.
        """

    def children_changed(self) -> None:
        """Adapt to a change of the children.

        When: after a change of the tree at or below this behavior, before children of it start or stop; the parameters
        have the new nodes. What: subscribe to new ones. Not: start or stop children here.
        """

    async def children_finished(self, status: BehaviorStatus, payload: Mapping[str, object]) -> None:
        """Conclude after the end of all children.

        When: the last child finished, or one aborted the others. What: by default, finish with the same status.
        """


def suspended_because(reason: str, by: str) -> str:
    """Return the reason of a suspension, as part of a sentence.

    Args:
        reason: The scheduler's word.
        by: The component that caused it; empty: none.

    Example:
        >>> suspended_because("higher", "console-1"), suspended_because("silent", "")
        ('higher by console-1', 'silent')
    """
    return f"{reason} by {by}" if by else reason
