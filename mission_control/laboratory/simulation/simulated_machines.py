"""Simulated machines in one event loop: creators and keepers are real, only zygotes and processes are simulated.

A process dies as a real one does: at once and without a further message. If a creator dies, all processes forked by its
zygote die, too. The audit gets the events of the laws: begins, killed, ends, gives up, fails.
"""

from __future__ import annotations

import asyncio
import contextvars
import signal
from collections.abc import Callable
from contextvars import ContextVar

from backbone.bus.clock import VirtualClock
from backbone.bus.interface import Bus, Clock
from backbone.component.class_path import load_class
from backbone.component.component import AnyComponent
from backbone.component.heartbeat import Vitals
from backbone.component.launch import Launch
from backbone.component.process import EXIT_BUG, EXIT_NO_HUB, EXIT_REFUSED
from backbone.component.shared_process import SharedProcess
from backbone.creator.service import Creator
from backbone.errors import BackboneError, HubUnreachable, Refusal
from backbone.waiting import set_within
from mission_control.laboratory.simulation.audit import Audit
from mission_control.laboratory.simulation.simulated_links import LinkedNetwork
from mission_control.laboratory.simulation.simulated_processes import ProcessLoop, SimulatedProcess, current_process

FORK_S = 0.02  # chosen: the duration of a fork and of a component's imports
HUB_WITHIN_S = 5.0  # zenoh_settings.OPEN_TIMEOUT_MS
FIRST_PID = 1000
LATE_STEPS = 5  # chosen: creator, owner, nameserver and observer each need a step, and may have just missed one


class Machines:
    """All machines of one mission.

    Attributes:
        network: Network of all processes.
        lives: Running components, by process.
        on_begin: Called with each process that was forked.
    """

    def __init__(self, loop: ProcessLoop, network: LinkedNetwork, audit: Audit) -> None:
        self.network = network
        self.lives: dict[SimulatedProcess, AnyComponent | SharedProcess | None] = {}
        self.on_begin: Callable[[SimulatedProcess], None] = lambda _process: None
        self._loop, self._audit = loop, audit
        self._tasks: dict[SimulatedProcess, asyncio.Task[int]] = {}
        self._zygotes: dict[SimulatedProcess, SimulatedZygote] = {}
        self._starved: dict[str, tuple[float, float]] = {}
        self._next_pid = FIRST_PID

    def find(self, name: str) -> SimulatedProcess | None:
        """Return the process of the component of this name, ready or not."""
        for process, life in self.lives.items():
            if process.name == name or (isinstance(life, SharedProcess) and name in life.members()):
                return process
        return None

    def component(self, name: str) -> AnyComponent | None:
        """Return the running component of this name, or None."""
        for process, life in self.lives.items():
            if isinstance(life, SharedProcess):
                if name in life.members():
                    return life.members()[name]
            elif process.name == name:
                return life
        return None

    def names(self, process: SimulatedProcess) -> list[str]:
        """Return the components of this process."""
        life = self.lives.get(process)
        return list(life.members()) if isinstance(life, SharedProcess) else [process.name]

    def vitals(self, _folder: str, pid: int) -> Vitals | None:
        """Return the vitals of a process; None if it has ended."""
        return next((process.vitals() for process in self.lives if process.pid == pid), None)

    def lateness_s(self) -> float:
        """Return the time between two moments in which a starved process runs; 0 without starved machines."""
        now_s = self._loop.time()
        gaps = [gap_s for until_s, gap_s in self._starved.values() if now_s < until_s + LATE_STEPS * gap_s]
        return LATE_STEPS * max(gaps, default=0.0)

    def starve(self, host: str, until_s: float, gap_s: float) -> None:
        """Give every process of this host, including new ones, a processor only for a moment every ``gap_s``."""
        self._starved[host] = max(until_s, self._starved.get(host, (0.0, 0.0))[0]), gap_s
        for process in self.lives:
            if process.host == host:
                process.starve(until_s, gap_s)

    def kill(self, process: SimulatedProcess, number: signal.Signals = signal.SIGKILL) -> None:
        """Send the process a signal."""
        life = self.lives.get(process)
        if process.is_dead or process not in self.lives:
            return
        if number is not signal.SIGKILL:
            if life is None:  # the process has no handler yet
                self.kill(process)
            else:
                process.run(self._loop.call_soon, life.end, number.name)
            return
        self._audit.note(process.name, "killed")
        process.die()
        self._tasks[process].cancel()

    def begin(self, name: str, host: str) -> SimulatedProcess:
        """Return a new, empty process."""
        self._next_pid += 1
        process = SimulatedProcess(self._loop, name, host, self._next_pid)
        self.network.begin(process)
        self.lives[process] = None
        until_s, gap_s = self._starved.get(host, (0.0, 0.0))
        if until_s > self._loop.time():
            process.starve(until_s, gap_s)
        return process

    def fork(self, launch: Launch, ended: Callable[[int, int], None]) -> SimulatedProcess:
        """Return a new process that runs the launch; ``ended`` gets its pid and returncode."""
        process = self.begin(launch.name, launch.host)
        task = self._loop.create_task(self._live(process, launch), name=launch.name, context=process.context)
        self._tasks[process] = task
        task.add_done_callback(lambda done: self._ended(process, done, ended), context=contextvars.Context())
        self.on_begin(process)
        return process

    def register(self, zygote: SimulatedZygote, owner: SimulatedProcess) -> None:
        """Record that the components of this zygote die with its owner."""
        self._zygotes[owner] = zygote

    async def end_all(self) -> None:
        """End all processes at once and wait for that."""
        for process in list(self.lives):
            process.die()
        while tasks := [task for process in self.network.processes() for task in process.end_tasks()]:
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _live(self, process: SimulatedProcess, launch: Launch) -> int:
        clock = VirtualClock()
        try:
            await clock.sleep_s(FORK_S)
            link = self.network.links[process]
            if not await set_within(link.usable, HUB_WITHIN_S):
                raise HubUnreachable(f"no hub listens for {launch.name}")
            life = self.lives[process] = self._born(process, launch, clock)
            self._audit.note(process.name, "begins")
            await life.run()
        except Exception as error:
            return self._note_end(process, error)
        self._audit.note(process.name, "ends")
        return 0

    def _born(self, process: SimulatedProcess, launch: Launch, clock: Clock) -> AnyComponent | SharedProcess:
        if launch.is_shared_process:
            return SharedProcess(launch, self.network.join, clock, process.pid, lambda: process.pid)
        component = load_class(launch.class_path)(launch, self.network.join(launch.address, clock), clock)
        component.pid = component.start_number = process.pid
        return component

    def _note_end(self, process: SimulatedProcess, error: Exception) -> int:
        what = f"{type(error).__name__}: {error}"
        if process.is_dead:
            return -signal.SIGKILL
        if isinstance(error, BackboneError):
            self._audit.note(process.name, "gives up", error=what)
            return EXIT_REFUSED if isinstance(error, Refusal) else EXIT_NO_HUB
        self._audit.note(process.name, "fails", error=what)
        return EXIT_BUG

    def _ended(self, process: SimulatedProcess, done: asyncio.Task[int], ended: Callable[[int, int], None]) -> None:
        process.die()
        process.end_tasks()
        self.lives.pop(process)
        self._tasks.pop(process)
        self.network.end(process)
        zygote = self._zygotes.pop(process, None)
        if zygote is not None:
            zygote.die()
        ended(process.pid, -signal.SIGKILL if done.cancelled() else done.result())


current_machines: ContextVar[Machines] = ContextVar("current_machines")
"""The machines of the present mission; creators find them here, because a mission names them only by class path."""


class SimulatedZygote:
    """Forks on one machine for one keeper, and dies with the keeper's process."""

    def __init__(self, machines: Machines) -> None:
        self.on_exit: Callable[[int, int], None] = lambda _pid, _returncode: None
        self.on_lost: Callable[[], None] = lambda: None
        self._machines = machines
        self._context = contextvars.copy_context()
        self._forked: dict[int, SimulatedProcess] = {}
        self._owner = current_process.get()
        if self._owner is not None:
            machines.register(self, self._owner)

    async def fork(self, launch: Launch) -> int:
        """Start the component and return its pid."""
        await asyncio.sleep(0)
        process = self._machines.fork(launch, self._exited)
        self._forked[process.pid] = process
        return process.pid

    def kill(self, pid: int, number: signal.Signals) -> None:
        """Send the signal."""
        if pid in self._forked:
            self._machines.kill(self._forked[pid], number)

    def keep_running(self) -> str:
        """Return no fault, because simulated zygotes are never paused."""
        return ""

    def busy_s(self) -> float:
        """Return zero, because simulated zygotes take no time."""
        return 0.0

    def die(self) -> None:
        """Kill all components of this zygote."""
        for process in list(self._forked.values()):
            self._machines.kill(process)

    async def close(self) -> None:
        """End all components of this zygote."""
        self.die()

    def _exited(self, pid: int, returncode: int) -> None:
        self._forked.pop(pid, None)
        if self._owner is None or not self._owner.is_dead:
            asyncio.get_running_loop().call_soon(self.on_exit, pid, returncode, context=self._context.copy())


class SimulatedCreator(Creator):
    """A creator on a simulated machine."""

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        machines = current_machines.get()
        super().__init__(launch, bus, clock, SimulatedZygote(machines), machines.vitals)

    def measure(self) -> tuple[float, float, int]:
        """Return the same load for every machine, because placements must not depend on the real machine."""
        return 0.1, 0.1, 4
