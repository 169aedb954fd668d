"""Acting: the task in which a behavior commands its robot during a grant.

Rule of this file: the task ends with the grant. After a temporary obstacle (a cut link, an operator's stop) it begins
again.
"""

from __future__ import annotations

import asyncio
import inspect
import logging

from backbone.component.messages import LogLevel
from backbone.errors import LinkError, OutcomeUnknown
from mission_control.behavior_hooks import BehaviorHooks
from mission_control.behavior_of_parts import BehaviorOfParts
from mission_control.child_keeper import AGAIN_AFTER_S
from resource_pool.arc_client import ArcClient, EmergencyStopped, StaleEpoch, SwappedOut

log = logging.getLogger(__name__)

CANCELLED_WITHIN_S = 0.1  # chosen: half the time in which a behavior must note the end of its grant; machine seconds


class Acting:
    """Runs ``BehaviorHooks.act``.

    Args:
        actor: The behavior.
        hooks: Its hooks; the same behavior.

    Attributes:
        resumes_again: True: ``resumed`` is called again before the next ``act``, because the robot could not be
            commanded meanwhile.
    """

    def __init__(self, actor: BehaviorOfParts, hooks: BehaviorHooks) -> None:
        self.resumes_again = self._has_told = False
        self._actor, self._hooks, self._clock = actor, hooks, actor.clock
        self._task: asyncio.Task[None] | None = None

    @property
    def is_under_way(self) -> bool:
        """True: it acts."""
        return self._task is not None and not self._task.done()

    def begin(self, arc: ArcClient) -> None:
        """Start ``act`` under the grant of this ARC."""
        self._task = self._actor.begin_task(self._act(arc), "act")
        if self._task is not None:
            self._task.add_done_callback(self._note_cancellation)

    async def stop(self) -> None:
        """Cancel the task and wait until it has ended; if it goes on, that is told with the place of ``act``."""
        task, self._task = self._task, None
        if task is None or task is asyncio.current_task():
            return
        task.cancel()
        _ended, goes_on = await asyncio.wait({task}, timeout=CANCELLED_WITHIN_S)
        if goes_on:
            told = f"act goes on after its cancellation ({self._place()})"
            self._actor.publish_event(self._actor.name, told, LogLevel.WARNING)
            await asyncio.wait({task})

    def drop(self) -> None:
        """Cancel the task without waiting for its end."""
        task, self._task = self._task, None
        cancel(task)

    async def _act(self, arc: ArcClient) -> None:
        while True:
            try:
                if self.resumes_again:
                    await self._hooks.resumed(arc.granted.rcs if arc.granted is not None else {})
                    self.resumes_again = False
                await self._hooks.act()
                return self._note_return()
            except (SwappedOut, StaleEpoch) as refusal:  # the grant ended first; ``resumed`` begins the next turn
                log.info("%s stopped acting: %s", self._actor.name, refusal.detail)
                return None
            except (LinkError, OutcomeUnknown) as error:  # no answer from the ARC, or none to the ARC
                log.info("%s acts again: %s", self._actor.name, error)
            except EmergencyStopped as stopped:
                await self._wait_until_it_may_move(arc, stopped)
                continue
            await self._clock.sleep_s(AGAIN_AFTER_S * self._clock.rate)

    def _note_cancellation(self, task: asyncio.Task[None]) -> None:
        """Count as a bug that ``act`` has cancelled its own task: the behavior would keep its RCs without a word."""
        if task.cancelled() and task is self._task:
            self._actor.begin_task(_fail(f"act was cancelled by its own code ({self._place()})"), "act")

    def _place(self) -> str:
        act = inspect.unwrap(type(self._hooks).act).__code__
        return f"{act.co_filename}, line {act.co_firstlineno}"

    def _note_return(self) -> None:
        """Report an ``act`` after which only the end of the grant takes the robot away; once in its story.

        A class that overrides ``see`` may finish at a picture, and a parent after its children: neither is reported.
        """
        kind, actor = type(self._hooks), self._actor
        finishes_later = kind.see is not BehaviorHooks.see or actor.child_nodes
        if kind.act is BehaviorHooks.act or finishes_later or actor.status.is_final or not actor.gate.is_open:
            return
        returned = "act has returned without finish, so the behavior keeps its RCs"
        actor.report(f"{actor.feedback}; {returned}")
        if not self._has_told:
            actor.publish_event(actor.name, returned, LogLevel.WARNING)
        self._has_told = True

    async def _wait_until_it_may_move(self, arc: ArcClient, stopped: EmergencyStopped) -> None:
        """Report the stop, and wait until it is lifted or its state is unknown."""
        held = self._actor.feedback
        self._actor.report(stopped.detail)
        try:
            await arc.wait_stop_lifted(str(stopped.facts["rc"]))
        except LinkError as error:
            log.info("%s does not know whether the stop is lifted: %s", self._actor.name, error)
            await self._clock.sleep_s(AGAIN_AFTER_S * self._clock.rate)
        else:
            self._actor.report(held)


async def _fail(told: str) -> None:
    raise RuntimeError(told)


def cancel(task: asyncio.Task[None] | None) -> None:
    """Cancel a task, unless it is the present task."""
    if task is not None and task is not asyncio.current_task():
        task.cancel()
