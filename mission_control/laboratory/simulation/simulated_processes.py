"""Simulated processes in one event loop; each can be paused, starved and killed separately.

A process is a context: all tasks of a component run in a copy of its process's context, so the loop knows the process
of each step. The steps of a stopped process wait. When the process continues, it first handles arrivals, then due
timers, as a real event loop does after SIGCONT.

Rule of this file: no knowledge of components, no decisions.
"""

from __future__ import annotations

import asyncio
import contextvars
from collections.abc import Callable, Coroutine
from contextvars import Context, ContextVar
from typing import Any, TypeVar, TypeVarTuple

from backbone.bus.clock import VirtualLoop
from backbone.component.heartbeat import BEAT_EVERY_S, Vitals

R = TypeVar("R")
Ts = TypeVarTuple("Ts")

WINDOW_S = 1e-6  # chosen: enough for all due work of a starved process, because virtual time stands still meanwhile
_NO_PROCESS = Context()


class SimulatedProcess:
    """A simulated process.

    Args:
        loop: Its event loop.
        name: Name of its component, or of the shared process.
        pid: Its pid, never used before.
    """

    def __init__(self, loop: ProcessLoop, name: str, host: str, pid: int) -> None:
        self.name, self.host, self.pid, self.is_dead = name, host, pid, False
        self.tasks: dict[asyncio.Task[object], None] = {}
        """Its tasks, in the order of their starts."""
        self._loop = loop
        self.context = contextvars.copy_context()
        self.context.run(current_process.set, self)
        self._pauses = 0
        self._starved_until_s = 0.0
        self._is_starved = self._in_window = False
        self._arrived: list[_Step] = []
        self._due: list[_Step] = []
        self._beats, self._since_s, self._queued_s = 1, loop.time(), 0.0

    def run(self, act: Callable[[*Ts], R], *arguments: *Ts) -> R:
        """Call ``act`` as a step of this process; it may only schedule work."""
        return self.context.copy().run(act, *arguments)

    @property
    def is_paused(self) -> bool:
        """True if it is stopped as by SIGSTOP."""
        return self._pauses > 0

    @property
    def is_stopped(self) -> bool:
        """True if its steps wait."""
        return not self.is_dead and (self.is_paused or (self._is_starved and not self._in_window))

    def pause(self) -> None:
        """Stop the process until ``go_on`` has been called as often as ``pause``."""
        self._settle()
        self._pauses += 1

    def go_on(self) -> None:
        """Undo one ``pause``."""
        self._settle()
        self._pauses -= 1
        self._catch_up()

    def starve(self, until_s: float, gap_s: float) -> None:
        """Give the process a processor only for a moment every ``gap_s``, until this time."""
        self._settle()
        self._starved_until_s = max(until_s, self._starved_until_s)
        self._is_starved = True
        first_s = self._loop.time() + gap_s * (1 + self.pid % 7) / 7  # processes run at different moments
        self._loop.call_at(first_s, self._open_window, gap_s, context=_NO_PROCESS)
        self._loop.call_at(until_s, self._end_starving, context=_NO_PROCESS)

    def die(self) -> None:
        """Run the remaining steps; the caller prevents that their messages leave the process."""
        self.is_dead = True
        self._catch_up()

    def end_tasks(self) -> list[asyncio.Task[object]]:
        """Cancel and return the tasks of a dead process."""
        for task in self.tasks:
            task.cancel()
        return list(self.tasks)

    def forget(self, task: asyncio.Task[object]) -> None:
        """Record that a task has ended."""
        self.tasks.pop(task, None)

    def vitals(self) -> Vitals:
        """Return its vitals."""
        self._settle()
        return Vitals(self._beats, 0.0, self._queued_s)

    def keep(self, step: _Step, *, is_timer: bool) -> None:
        """Keep a step until the process continues."""
        (self._due if is_timer else self._arrived).append(step)

    def _end_starving(self) -> None:
        if self._loop.time() >= self._starved_until_s - WINDOW_S:
            self._settle()
            self._is_starved = False
            self._catch_up()

    def _open_window(self, gap_s: float) -> None:
        if self.is_dead or not self._is_starved:
            return
        self._settle()
        self._in_window = True
        self._catch_up()
        now_s = self._loop.time()
        self._loop.call_at(now_s + WINDOW_S, self._close_window, context=_NO_PROCESS)
        self._loop.call_at(now_s + gap_s, self._open_window, gap_s, context=_NO_PROCESS)

    def _close_window(self) -> None:
        self._settle()
        self._in_window = False

    def _settle(self) -> None:
        """Count the time since the last change as running, queued or stopped."""
        now_s = self._loop.time()
        elapsed_s, self._since_s = now_s - self._since_s, now_s
        if self.is_paused:
            return
        if self._is_starved and not self._in_window:
            self._queued_s += elapsed_s
        else:
            self._beats += 1 + int(elapsed_s / BEAT_EVERY_S)

    def _catch_up(self) -> None:
        if self.is_stopped:
            return
        arrived, self._arrived, due, self._due = self._arrived, [], self._due, []
        for step in (*arrived, *due):
            self._loop.begin(step)


current_process: ContextVar[SimulatedProcess | None] = ContextVar("current_process", default=None)
"""The process of the present step; None: the simulation itself."""


class _Step(asyncio.Handle):
    """A step of a process."""

    timer: asyncio.TimerHandle | None = None

    def do(self) -> None:
        """Run the step unless it was cancelled meanwhile."""
        if not self.cancelled() and not (self.timer is not None and self.timer.cancelled()):
            self._run()


class ProcessLoop(VirtualLoop):
    """An event loop on virtual time; the steps of stopped processes wait."""

    def call_soon(
        self, callback: Callable[[*Ts], object], *args: *Ts, context: Context | None = None
    ) -> asyncio.Handle:
        """Call the callback soon, or when its process continues; see ``asyncio.AbstractEventLoop.call_soon``."""
        process = current_process.get() if context is None else context.get(current_process)
        if process is None or not process.is_stopped:
            return super().call_soon(callback, *args, context=context)
        step = _Step(callback, args, self, context)
        process.keep(step, is_timer=False)
        return step

    def call_at(
        self, when: float, callback: Callable[[*Ts], object], *args: *Ts, context: Context | None = None
    ) -> asyncio.TimerHandle:
        """Call the callback at this time, or when its process continues; see ``asyncio.AbstractEventLoop.call_at``."""
        process = current_process.get() if context is None else context.get(current_process)
        if process is None:
            return super().call_at(when, callback, *args, context=context)
        step = _Step(callback, args, self, context)
        step.timer = super().call_at(when, self._due, process, step, context=_NO_PROCESS)
        return step.timer

    def create_task(  # Any: the types of coroutines differ between versions of Python
        self, coro: Any, *, name: object = None, context: Context | None = None, **options: bool | None
    ) -> asyncio.Task[Any]:
        """Begin a task of the present process; see ``asyncio.AbstractEventLoop.create_task``."""
        task = super().create_task(coro, name=None if name is None else str(name), context=context, **options)
        process = current_process.get() if context is None else context.get(current_process)
        if process is not None:
            process.tasks[task] = None
            task.add_done_callback(process.forget, context=_NO_PROCESS)
        return task

    def begin(self, step: _Step) -> None:
        """Run a step that waited."""
        super().call_soon(step.do, context=_NO_PROCESS)

    @staticmethod
    def _due(process: SimulatedProcess, step: _Step) -> None:
        if process.is_stopped:
            process.keep(step, is_timer=True)
        else:
            step.do()


def run_processes(main: Coroutine[object, None, R]) -> R:
    """Run the coroutine on a new ``ProcessLoop`` and return its result."""
    with asyncio.Runner(loop_factory=ProcessLoop) as runner:
        return runner.run(main)
