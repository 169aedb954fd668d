"""The life of every component: register, connect, ready, serve, drain, stop.

A component is a class with a few hooks. The shell in this file calls the hooks in their order, answers the common
questions of every component, and declares the liveliness token last, so that the component answers as soon as its
token exists.

Rule: a bug ends the component. Its process exits with an error, its creator reports and restarts it.
"""

from __future__ import annotations

import asyncio
import logging
import os
from collections.abc import Coroutine, Mapping
from typing import ClassVar, Generic, TypeVar, cast

import msgspec

from backbone.authentication import secret_of
from backbone.bus.host_boards import boards_for
from backbone.bus.interface import Bus, Clock, Subscription
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.component.abilities import NO_ABILITIES, Abilities
from backbone.component.common_answers import CommonAnswers
from backbone.component.launch import Launch
from backbone.component.messages import Absence, CommonQuestion, ComponentState, LastStop, LifeState, LogLevel
from backbone.component.name_claim import claim_name
from backbone.component.own_tasks import OwnTasks
from backbone.component.parameter_values import parameters_from
from backbone.component.story import StoryBook, feedback_of
from backbone.component.unreadable_keys import UnreadableKeys
from backbone.errors import BackboneError, Refusal
from backbone.incarnation import random_start
from backbone.keys import Conversation
from backbone.printable_text import printable
from backbone.waiting import first_of, only_bugs
from backbone.wire import Accepts, Envelope, Message, UnknownMessage

log = logging.getLogger(__name__)

DRAIN_WITHIN_S = 10.0  # chosen: ten times the longest drain of a component without processes; machine seconds
CALM_S = 0.02  # chosen: longer than a context switch, which must not wait for published news; people see no difference


class NoParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """For components without parameters."""


P_co = TypeVar("P_co", bound=msgspec.Struct, covariant=True)


class Component(Generic[P_co]):
    """Base of every component; derive, set the class variables, override the hooks you need.

    Args:
        launch: Name, type, host and initial parameters of this component.

    Raises:
        WrongParameter: The launch's parameters do not fit ``parameters_type``.
    """

    parameters_type: ClassVar[type[msgspec.Struct]] = NoParameters
    given_elsewhere: ClassVar[frozenset[str]] = frozenset()
    """Parameters that a mission file sets by other elements and attributes, not by <parameter>."""
    fixed: ClassVar[frozenset[str]] = frozenset()
    """Parameters whose change has no effect while it runs; it refuses the change."""
    accepts: ClassVar[Accepts | None] = None
    """Its own questions, besides the common ones: a message class or a union of them."""
    is_robot: ClassVar[bool] = False
    """True for the RC of a robot, which operators can stop."""
    shares_process: ClassVar[bool] = True
    """False for a class that computes for long or forks: unless the mission file names a process, it has its own."""
    alike_most: ClassVar[int] = 0
    """Most components of this class in one process, if a host has more of them and the mission file names no process;
    1: each has its own; 0: the placer's default, or 1 if ``shares_process`` is False."""
    drains_within_s: ClassVar[float | None] = DRAIN_WITHIN_S
    """Longest time of its drain after a bug, machine seconds; None: as long as it takes, because it ends others."""
    registers: ClassVar[bool] = True
    """False only for the nameserver, which keeps the registry itself."""

    @classmethod
    def driver_options(cls, named: str = "") -> dict[str, type[msgspec.Struct]] | None:  # noqa: ARG003
        """Return the additional parameters of each built-in driver, and of this one; None: it uses no driver."""
        return None

    @classmethod
    def abilities(cls) -> Abilities:
        """Return the commands and reports of its components."""
        return NO_ABILITIES

    @classmethod
    def before_bus(cls, launch: Launch) -> None:
        """Prepare the process.

        When: at the start of a new process, before the event loop and before any bus is open.
        What: fork a zygote, which is impossible later.
        Not: anything that needs other components.
        """

    @classmethod
    def open_bus(cls, launch: Launch, clock: Clock) -> Bus:
        """Open the component's bus: a client of the hub, unless the class is the hub."""
        config = client_config(launch.endpoint, secret_of(launch.run_directory))
        bus = ZenohBus.open(launch.mission, launch.address, clock, config)
        bus.use_host(launch.run_directory)
        bus.boards = boards_for(launch.run_directory)
        return bus

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        self.launch, self.bus, self.clock = launch, bus, clock
        self.address = launch.address
        """``<subsystem>/<name>``."""
        self.pid, self.start_number = os.getpid(), random_start()
        """Pid of its process, and number of this life. A simulation sets other numbers."""
        self.parameters: P_co = cast(P_co, parameters_from(launch.parameters, self.parameters_type, launch.name))
        self.story = StoryBook(self.address, clock)
        self.feedback = ""
        self._state, self._since_s = LifeState.CONNECTING, clock.now_s()
        self._end = asyncio.Event()
        self._bug: BaseException | None = None
        self._tasks = OwnTasks(self.fail, self._task_goes_on)
        self._token: Subscription | None = None
        self._news = asyncio.Event()
        self._state_published: ComponentState | None = None

    async def connect(self) -> None:
        """Connect to everything that the component needs.

        When: once, before the component answers questions; cancelled if the component must end meanwhile. What:
        subscribe, ask other components, open devices. Not: wait for a component that waits for this one's readiness.
        """

    async def serve(self) -> None:
        """Do the component's own work.

        When: from readiness on. What: loop until cancelled, or return when the work is done; the component continues to
        answer questions until it is stopped or calls ``end``.
        """

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Return the reply to one of the questions in ``accepts``, or raise a ``Refusal``.

        When: at any time between readiness and stop, also while draining, several at once. Not: wait for the requester.
        """
        raise UnknownMessage(f"{type(asked.body).__name__} is not answered here")

    async def drain(self) -> None:
        """Go to the safe state.

        When: once if ``connect`` succeeded, also after a bug, when ``serve`` and all tasks have ended, or go on longer
        than ``TASKS_END_WITHIN_S``, and the bus and the liveliness token still exist. Cancelled if it takes longer than
        ``drains_within_s`` after a bug. What: finish or undo work in progress, leave hardware safe. Not: begin new
        work.
        """

    def parameters_changed(self) -> None:
        """Apply ``self.parameters``, which hold new, checked values.

        When: after each change, not at the start. A ``Refusal`` raised here restores the old parameters.
        """

    def statistics(self) -> dict[str, float]:
        """Return named counters and measures, units in the names.

        One that is no finite number is left out; after an exception all are, and a warning in the log names it.
        """
        return {}

    def absences(self) -> list[Absence]:
        """Return the absent components that this one wants.

        When: while it is ready, for each published state. Call ``changed`` when the result changes.
        """
        return []

    def last_stop(self) -> LastStop:
        """Return the last emergency stop of this component; call ``changed`` when the result changes."""
        return LastStop()

    def resume_stop(self, last: LastStop) -> None:
        """Take over the last emergency stop of the former component of this name, perhaps on another host.

        When: before ``connect``, if that component was ever stopped.
        """

    def person(self) -> str:
        """Return the name of the person at this component; empty: no person."""
        return ""

    def calm_s(self) -> float:
        """Return how long news wait for further news, seconds of the machine.

        When: before each ``publish_news``. Override if news take long to make.
        """
        return CALM_S

    def answered_state(self) -> ComponentState:
        """Return the state for an answer; if it was not published, the next news are published in any case.

        Else the state could be as published again when its news are due, and the asker would keep this one.
        """
        state = self.component_state()
        if state != self._state_published:
            self._state_published = None
        return state

    def publish_news(self) -> None:
        """Publish the component's news: its state, if it differs from what is known of it.

        When: ``CALM_S`` after ``report`` or ``changed``, once for all news in between.
        """
        if self.component_state() != self._state_published:
            self._publish_state()

    @property
    def name(self) -> str:
        """Name of the component, unique in the mission."""
        return self.launch.name

    @property
    def state(self) -> LifeState:
        """Present state of the component's life cycle."""
        return self._state

    def with_parameters(self, changed: Mapping[str, object]) -> P_co:
        """Return the parameters with these values replaced, or raise ``WrongParameter``."""
        return cast(P_co, parameters_from({**msgspec.to_builtins(self.parameters), **changed}, self.parameters_type))

    def change_parameters(self, changed: Mapping[str, object]) -> None:
        """Replace these parameters, unless the values do not fit or ``parameters_changed`` refuses them."""
        before, self.parameters = self.parameters, self.with_parameters(changed)
        try:
            self.parameters_changed()
        except Refusal:
            self.parameters = before
            raise

    def start_task(self, work: Coroutine[object, None, None], name: str) -> asyncio.Task[None]:
        """Run the coroutine beside ``serve``, until the component ends; its bug is the component's bug.

        If the component is ending, the returned task is cancelled at once.

        Raises:
            RuntimeError: The component is not connecting yet.
        """
        if not (self._tasks.are_taken or self._end.is_set()):
            work.close()
            raise RuntimeError(f"{self.address} starts {name} before it connects")
        return self._tasks.start(work, f"{self.name}:{name}")

    def report(self, feedback: str) -> None:
        """Set the feedback, which is made one printable line for people; it is published soon if it has changed."""
        feedback = printable(feedback)
        if feedback != self.feedback:
            self.feedback = feedback
            self.changed()

    def changed(self) -> None:
        """Call ``publish_news`` soon."""
        self._news.set()

    def publish_event(self, subject: str, what: str, level: LogLevel = LogLevel.INFO) -> None:
        """Add an event about the subject to the story, and publish it to the mission's log."""
        self.bus.publish(self.address, Conversation.LOG, self.story.note(subject, what, level))

    def end(self, reason: str) -> None:
        """End in good order; then ``run`` returns."""
        if not self._end.is_set():
            self.story.note(self.name, f"ends: {reason}")
            self._end.set()

    def fail(self, bug: BaseException) -> None:
        """End because of a bug; ``run`` raises it."""
        if self._bug is None:
            self._bug = bug
            self.feedback = feedback_of(bug)
            self.story.note(self.name, f"failed: {self.feedback}")
            is_refusal = isinstance(bug, BackboneError)  # its detail is clearer than a traceback
            log.error("%s failed: %s", self.address, self.feedback, exc_info=None if is_refusal else bug)
        self._end.set()

    def component_state(self) -> ComponentState:
        """Return address, process and state of this component."""
        launch, last_stop = self.launch, self.last_stop()
        return ComponentState(
            launch.address,
            launch.type,
            launch.host,
            self.pid,
            self._state,
            self._since_s,
            self.feedback,
            launch.requester,
            self.absences() if self._state is LifeState.READY else [],
            last_stop.standing,
            self.person(),
            self.is_robot,
            self.start_number,
            last_stop.number,
        )

    async def run(self) -> None:
        """Run the component's whole life cycle; return after an end in good order.

        If cancelled, the component ends as if its process were killed: it neither drains nor publishes.

        Raises:
            NameTaken: A living component has the name; this component published nothing.
            LinkError: No nameserver answered within ``REGISTER_WITHIN_S``.
            BaseException: The bug that ended the component.
        """
        self.bus.on_bug, self.bus.on_unreadable, self.bus.is_kept = self.fail, UnreadableKeys(self).log, True
        try:
            if await self._unless_ended(self._claim_name(), "claim"):
                await self._live_and_report_end()
        finally:
            await self.leave_bus()
        if self._bug is not None:
            raise self._bug

    async def leave_bus(self) -> None:
        """Withdraw all declarations of the component."""
        self.bus.is_kept = False
        await self.bus.close()

    async def _claim_name(self) -> None:
        if self.registers and (last := await claim_name(self.bus, self.clock, self.component_state())) != LastStop():
            self.resume_stop(last)

    async def _live_and_report_end(self) -> None:
        try:
            await self._live()
        except Exception as bug:
            self.fail(bug)
        if self._bug is not None:
            self.feedback = feedback_of(self._bug)  # draining may have reported something else
        self._enter(LifeState.FAILED if self._bug is not None else LifeState.STOPPED)
        if self._token is not None:
            self._token.close()

    async def _live(self) -> None:
        connected, self._tasks.are_taken = False, True
        try:
            connected = await self._unless_ended(self.connect(), "connect")
            if connected:
                await only_bugs(self._serve_until_end(), self.name)
        except Exception as bug:
            self.fail(bug)
        finally:
            self._end.set()  # also if it is killed, so that later messages start no work
            await self._tasks.end()
        if connected:
            if self._state is LifeState.READY:
                self._enter(LifeState.DRAINING)
            async with asyncio.timeout(None if self._bug is None else self.drains_within_s):  # else its creator counts
                await only_bugs(self.drain(), f"{self.name}:drain")

    async def _serve_until_end(self) -> None:
        accepted = CommonQuestion if self.accepts is None else CommonQuestion | self.accepts
        self.bus.serve(self.address, accepted, CommonAnswers(self).answer)
        self.start_task(self.serve(), "serve")
        self.start_task(self._publish_when_calm(), "publish")
        self._enter(LifeState.READY)
        self._token = self.bus.declare_alive(self.address)
        await self._end.wait()
        self._enter(LifeState.DRAINING)

    def _task_goes_on(self, task: str) -> None:
        self.story.note(self.name, f"{task} goes on after its cancellation")

    async def _unless_ended(self, work: Coroutine[object, None, None], name: str) -> bool:
        """Run the work unless the component must end first; return whether the work was finished."""
        if self._end.is_set():
            work.close()
            return False
        working = asyncio.create_task(only_bugs(work), name=f"{self.name}:{name}")
        working.add_done_callback(lambda _ended: work.close())
        await first_of(working, self._end.wait())
        return not working.cancelled() and working.result() is None

    def _enter(self, state: LifeState) -> None:
        self._state, self._since_s = state, self.clock.now_s()
        self.story.note(self.name, f"is {state}")
        self._publish_state()

    async def _publish_when_calm(self) -> None:
        while True:
            await self._news.wait()
            await self.clock.sleep_s(self.calm_s() * self.clock.rate)
            self._news.clear()
            self.publish_news()

    def _publish_state(self) -> None:
        self._state_published = self.component_state()
        self.bus.publish(self.address, Conversation.STATUS, self._state_published)


AnyComponent = Component[msgspec.Struct]
"""A component with parameters of any kind."""
