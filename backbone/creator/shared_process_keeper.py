"""Shared process keeper: carries out the decisions of ``SharedProcesses`` with a zygote and over the bus."""

from __future__ import annotations

import asyncio
import logging
import math
import signal
from collections.abc import Callable, Coroutine
from typing import assert_never

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.asking import ask_until_answered
from backbone.component.launch import Launch
from backbone.component.membership import (
    AwaitEnd,
    BeginMember,
    EndMember,
    MemberBegun,
    MemberEnded,
    MemberEnding,
    process_address,
)
from backbone.creator.alarm import Alarm
from backbone.creator.decisions import Instruction
from backbone.creator.failed_starts import cause_of_end
from backbone.creator.shared_processes import (
    AdmitMember,
    EndMemberAlone,
    ForkProcess,
    MemberGone,
    MemberNotStarted,
    MemberRuns,
    ProcessesWakeAt,
    ProcessInstruction,
    SharedProcesses,
    SignalProcess,
)
from backbone.creator.supervision import Supervision
from backbone.creator.zygote import Forks, NoProcess
from backbone.errors import BackboneError, Refusal
from backbone.naming import Subsystem

log = logging.getLogger(__name__)

ADMIT_EACH_S = 1.0  # chosen: a thousand times longer than an answer takes
AWAIT_EACH_S = 60.0  # chosen: the question stays open until the member ends; it is repeated in case its answer was lost


class SharedProcessKeeper:
    """Forks the processes that components share, has them admit members, and waits for the members' ends."""

    def __init__(
        self,
        zygote: Forks,
        clock: Clock,
        supervision: Supervision,
        *,
        launch_of: Callable[[str], Launch],
        report: Callable[[list[Instruction]], None],
        task: Callable[[Coroutine[object, None, None], str], asyncio.Task[None]],
    ) -> None:
        """Keep no process yet.

        Args:
            zygote: Forks and signals the processes.
            clock: Deadlines are in seconds of the machine.
            supervision: Gets the start and the end of each member.
            launch_of: Name of a kept component → its launch.
            report: Carries out what supervision decides about a member.
            task: Runs work under a name; the caller cancels it at the end.
        """
        self._zygote, self._clock, self._supervision = zygote, clock, supervision
        self._launch_of, self._report, self._task = launch_of, report, task
        self._shared = SharedProcesses()
        self._bus: Bus | None = None
        self._alarm = Alarm(clock, task, self._woken, "shared processes' alarm")
        self._talks: dict[int, set[asyncio.Task[None]]] = {}
        self._launches: dict[int, Launch] = {}

    def use(self, bus: Bus) -> None:
        """Use this bus from now on to reach shared processes."""
        self._bus = bus

    def has(self, pid: int) -> bool:
        """Return whether the process of this pid is shared."""
        return self._shared.has(pid)

    def pids(self) -> set[int]:
        """Return the pids of all shared processes."""
        return self._shared.pids()

    def wanted(self, launch: Launch) -> None:
        """Run the component in the process that its launch names."""
        self._carry_out(self._shared.wanted(launch.name, launch.process, self._now_s()))

    def serving(self, process: str, pid: int) -> None:
        """Admit the members that wait for this process, which answers from now on."""
        self._carry_out(self._shared.serving(process, pid, self._now_s()))

    def signalled(self, name: str, number: signal.Signals) -> None:
        """End the member, with its process if the member alone cannot be ended."""
        self._carry_out(self._shared.signalled(name, number))

    def observed(self, pid: int, silent_s: float, now_s: float, late_s: float) -> None:
        """Record for how long the process has shown no sign of life, and for how long it could not run."""
        self._carry_out(self._shared.observed(pid, silent_s, now_s, late_s))

    def exited(self, pid: int, returncode: int) -> None:
        """Report the end of the process to all its members."""
        for talk in self._talks.pop(pid, set()):
            talk.cancel()
        cause = cause_of_end(self._launches.pop(pid, None), pid, returncode)
        self._carry_out(self._shared.exited(pid, returncode, cause))

    def _carry_out(self, instructions: list[ProcessInstruction]) -> None:
        for instruction in instructions:
            match instruction:
                case ForkProcess(process=process, name=name):
                    self._task(self._fork_process(process, self._launch_of(name)), f"fork {process}")
                case AdmitMember(process=process, pid=pid, name=name, life=life):
                    launch = self._launch_of(name)
                    at = process_address(launch.host, process, pid)
                    self._talk(pid, self._share_life(self._required_bus(), at, launch, pid, life), f"life of {name}")
                case EndMemberAlone(process=process, pid=pid, name=name, life=life):
                    at = process_address(self._launch_of(name).host, process, pid)
                    self._talk(pid, self._end_member(self._required_bus(), at, life), f"end {name}")
                case SignalProcess(process=process, pid=pid, number=number):
                    log.info("%s to shared process %s, pid %d", number.name, process, pid)
                    self._zygote.kill(pid, number)
                case MemberRuns(name=name, pid=pid):
                    self._report(self._supervision.forked(name, pid, self._now_s()))
                case MemberNotStarted(name=name, why=why, returncode=returncode):
                    self._report(self._supervision.fork_failed(name, why, self._now_s(), returncode))
                case MemberGone(name=name, returncode=returncode, how=how, cause=cause):
                    self._report(self._supervision.left(name, returncode, how, self._now_s(), cause))
                case ProcessesWakeAt(at_s=at_s):
                    self._alarm.set(at_s)
                case _:
                    assert_never(instruction)

    async def _fork_process(self, process: str, member: Launch) -> None:
        launch = msgspec.structs.replace(
            member,
            subsystem=Subsystem.BACKBONE,
            name=process,
            type="shared_process",
            class_path="",
            parameters={},
            requester="" if self._bus is None else self._bus.source,
        )
        try:
            pid = await self._zygote.fork(launch)
        except NoProcess as error:
            self._carry_out(self._shared.fork_failed(process, str(error)))
            return
        self._launches[pid] = launch
        self._carry_out(self._shared.forked(process, pid, self._now_s()))

    async def _share_life(self, bus: Bus, at: str, launch: Launch, pid: int, life: int) -> None:
        """Have the shared process admit the component, then wait for its end; cancelled when the process ends."""
        try:
            await ask_until_answered(
                bus, self._clock, at, BeginMember(launch, life), MemberBegun, each_s=ADMIT_EACH_S, within_s=math.inf
            )
        except Refusal as refusal:
            self._carry_out(self._shared.refused(life, str(refusal), self._now_s()))
            return
        self._carry_out(self._shared.admitted(life))
        ended = await ask_until_answered(
            bus, self._clock, at, AwaitEnd(life), MemberEnded, each_s=AWAIT_EACH_S, within_s=math.inf
        )
        cause = cause_of_end(launch, pid, ended.exit_code) if ended.exit_code else ""
        self._carry_out(self._shared.member_ended(life, ended.exit_code, self._now_s(), cause))

    async def _end_member(self, bus: Bus, at: str, life: int) -> None:
        try:
            await bus.ask(at, EndMember(life), MemberEnding, within_s=ADMIT_EACH_S)
        except BackboneError as error:  # supervision's next step is to kill the process
            log.info("%s did not accept the order to end a member: %s", at, error)

    def _woken(self) -> None:
        self._carry_out(self._shared.woken(self._now_s()))

    def _required_bus(self) -> Bus:
        if self._bus is None:
            raise RuntimeError("a shared process serves before its keeper has a bus")
        return self._bus

    def _talk(self, pid: int, work: Coroutine[object, None, None], name: str) -> None:
        """Run work that is cancelled when its shared process ends."""
        talks, talk = self._talks.setdefault(pid, set()), self._task(work, name)
        talks.add(talk)
        talk.add_done_callback(talks.discard)

    def _now_s(self) -> float:
        return self._clock.now_s() / self._clock.rate
