"""Shared process: it begins without members, and its creator admits them.

Each member is a component with a bus, a token and a story of its own. The members share the event loop, the session to
the hub and the pid. If a member ends, also by a bug, the others continue. If a member blocks the event loop, it blocks
all members, and the creator ends the whole process.

SIGTERM ends all members in good order, the last admitted first, and then the process.
"""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from collections.abc import Callable
from dataclasses import dataclass, field

from backbone.authentication import secret_of
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus, Clock
from backbone.bus.shared_bus import SharedSession
from backbone.component.class_path import load_class
from backbone.component.component import AnyComponent, Component
from backbone.component.launch import Launch
from backbone.component.membership import (
    AlreadyMember,
    AskedAgain,
    AwaitEnd,
    BeginMember,
    EndMember,
    MemberBegun,
    MemberEnded,
    MemberEnding,
    NeedsOwnProcess,
    NotAMember,
    NotItsCreator,
    ProcessQuestion,
    process_address,
)
from backbone.component.messages import LogLevel
from backbone.component.process import exit_code_of, run_to_end, run_with_heartbeat
from backbone.component.stray_faults import strays_told
from backbone.incarnation import random_start
from backbone.waiting import end_tasks, only_bugs
from backbone.wire import Envelope, Message, UnknownMessage


@dataclass
class _Member:
    """One life in this process.

    Attributes:
        component: None until its class is loaded.
        ended: Its exit code, after its end.
        end_reason: Why it must end; empty: it continues.
    """

    launch: Launch
    component: AnyComponent | None = None
    ended: asyncio.Future[int] = field(default_factory=lambda: asyncio.get_running_loop().create_future())
    end_reason: str = ""
    asked: asyncio.Future[int] | None = None

    async def wait_ended(self) -> int:
        """Return its exit code after its end; an older question that still waits is refused.

        Raises:
            AskedAgain: A newer question replaced this one.
        """
        if self.asked is not None and not self.asked.done():
            self.asked.set_exception(AskedAgain(f"a newer question waits for the end of {self.launch.name}"))
        self.asked = asyncio.shield(self.ended)
        return await self.asked

    def end(self, reason: str) -> None:
        """End the member in good order, as soon as its component exists."""
        self.end_reason = self.end_reason or reason
        if self.component is not None:
            self.component.end(reason)


class SharedProcess:
    """The members of this process and the answers to its creator.

    Args:
        launch: Launch of the process itself; see ``Launch.process``.
        join: Returns a bus for a source; all these buses are neighbors.
        clock: The mission's clock, for all members.
        start_of: Returns the start of a new member's incarnation.
    """

    def __init__(
        self,
        launch: Launch,
        join: Callable[[str, Clock], Bus],
        clock: Clock,
        pid: int,
        start_of: Callable[[], int] = random_start,
    ) -> None:
        self.address = process_address(launch.host, launch.process, pid)
        self._launch, self._join, self._clock, self._pid = launch, join, clock, pid
        self._start_of = start_of
        self._members: dict[int, _Member] = {}
        self._lives: dict[int, asyncio.Task[None]] = {}
        self._end = asyncio.Event()
        self._bug: BaseException | None = None

    async def run(self) -> None:
        """Answer the creator until the process must end; return when every member has ended.

        If cancelled, it ends with its members as if it were killed.

        Raises:
            BaseException: A bug in this file.
        """
        bus = self._join(self.address, self._clock)
        bus.on_bug = self._fail
        try:
            bus.serve(self.address, ProcessQuestion, self._answer)
            bus.declare_alive(self.address)
            await self._end.wait()
            for life in reversed(self._lives):
                self._members[life].end("its process ends")
            await asyncio.gather(*self._lives.values())
        finally:
            await end_tasks(*self._lives.values())
            await bus.close()
        if self._bug is not None:
            raise self._bug

    def end(self, _reason: str = "") -> None:
        """End all members in good order; then ``run`` returns."""
        self._end.set()

    def members(self) -> dict[str, AnyComponent]:
        """Return the present members, by name."""
        living = [self._members[life] for life in self._lives]
        return {member.launch.name: member.component for member in living if member.component is not None}

    def tell(self, fault: str, task: str) -> None:
        """Tell a stray fault in the story of the member whose task it was; if it was no member's, in that of each."""
        members = self.members()
        own = members.get(task.partition(":")[0])
        for one in members.values() if own is None else [own]:
            of_whom = f"in {self._launch.process}: " if own is None and len(members) > 1 else ""
            one.publish_event(one.name, f"{of_whom}{fault}", LogLevel.WARNING)

    async def _answer(self, asked: Envelope[Message]) -> Message:
        if asked.source != self._launch.requester:
            raise NotItsCreator(f"{asked.source} asked {self.address} for {type(asked.body).__name__}")
        match asked.body:
            case BeginMember(launch=launch, life=life):
                self._admit(launch, life)
                return MemberBegun()
            case AwaitEnd(life=life):
                return MemberEnded(life, await self._member(life).wait_ended())
            case EndMember(life=life):
                self._member(life).end(f"ordered by {asked.source}")
                return MemberEnding()
            case _:
                raise UnknownMessage(f"{type(asked.body).__name__} is not answered here")

    def _member(self, life: int) -> _Member:
        member = self._members.get(life)
        if member is None:
            raise NotAMember(f"no life {life} was begun in {self.address}", life=life)
        return member

    def _admit(self, launch: Launch, life: int) -> None:
        if life in self._members:  # the answer was lost
            return
        for other in self._lives:
            if self._members[other].launch.name == launch.name:
                raise AlreadyMember(f"{launch.name} lives in {self.address} as life {other}", life=other)
        former = [one for one, member in self._members.items() if member.launch.name == launch.name]
        for one in former:  # ended, and the creator knows it
            del self._members[one]
        member = self._members[life] = _Member(launch)
        if self._end.is_set():
            member.end("its process ends")
        self._lives[life] = asyncio.create_task(self._live(member, life), name=launch.name)

    async def _live(self, member: _Member, life: int) -> None:
        exit_code = 0
        try:
            await only_bugs(self._live_as(member), member.launch.address)
        except Exception as error:  # as at the end of a process of its own
            exit_code = exit_code_of(error, member.launch.address)
        del self._lives[life]
        member.component = None
        member.ended.set_result(exit_code)

    async def _live_as(self, member: _Member) -> None:
        launch = member.launch
        component_class = await _load(launch.class_path)
        if member.end_reason:
            return
        bus = self._join(launch.address, self._clock)
        try:
            component = component_class(launch, bus, self._clock)
        except BaseException:
            await bus.close()
            raise
        component.pid, component.start_number = self._pid, self._start_of()
        member.component = component
        await component.run()

    def _fail(self, bug: BaseException) -> None:
        self._bug = self._bug or bug
        self.end()


def run_shared_process(launch: Launch) -> int:
    """Run the shared process of this launch and return the process's exit code."""
    return run_to_end(launch, lambda: _live(launch))


async def _live(launch: Launch) -> None:
    session = SharedSession(launch.mission, launch.endpoint, secret_of(launch.run_directory), launch.run_directory)
    try:
        clock = MissionClock(launch.clock_origin_monotonic_s, launch.clock_rate)
        shared = SharedProcess(launch, session.join, clock, os.getpid())
        for number in (signal.SIGTERM, signal.SIGINT):
            asyncio.get_running_loop().add_signal_handler(number, shared.end)
        with strays_told(shared.tell):
            await run_with_heartbeat(launch, clock, shared.run())
    finally:
        await session.close()


async def _load(class_path: str) -> type[AnyComponent]:
    """Import and return the class without blocking the other members.

    Raises:
        WrongClassPath: No component class has this path.
        NeedsOwnProcess: The class must not share a process.
    """
    if class_path.partition(":")[0] in sys.modules:
        found = load_class(class_path)
    else:
        found = await asyncio.to_thread(load_class, class_path)
    for hook in ("before_bus", "open_bus"):
        if getattr(found, hook).__func__ is not getattr(Component, hook).__func__:
            raise NeedsOwnProcess(f"{class_path} has a {hook} of its own", class_path=class_path)
    return found
