"""KeptComponents: the components of a process keeper, and the callers that wait for their starts and ends.

Rule of this file: each waiting caller gets an outcome, or waits on because the component is started again.
"""

from __future__ import annotations

import asyncio
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import msgspec

from backbone.component.launch import Launch
from backbone.creator.decisions import ReportEnded, ReportFell, ReportLeft, ReportReady, ReportStartFailed
from backbone.creator.failed_starts import start_failed
from backbone.creator.messages import NotHere, ProcessEnded, RestartPolicy, ReviseSpawn, Spawn, StartFailed
from backbone.waiting import settle

Report = ReportReady | ReportStartFailed | ReportEnded | ReportLeft | ReportFell
"""Supervision's reports of the start and the end of a component."""


@dataclass
class Kept:
    """The keeper's record of a supervised component."""

    launch: Launch
    order: Spawn
    end_reason: str = ""


class KeptComponents(dict[str, Kept]):
    """Name of a kept component → its record."""

    def __init__(self) -> None:
        super().__init__()
        self._failures: dict[str, StartFailed] = {}
        self._starting: dict[str, list[asyncio.Future[int]]] = {}
        self._ending: dict[str, list[asyncio.Future[ProcessEnded]]] = {}

    def begin(self, launch: Launch, order: Spawn) -> None:
        """Keep a component from its start on."""
        self[launch.name] = Kept(launch, order)
        self._failures.pop(launch.name, None)

    def retain(self, names: Collection[str]) -> None:
        """Keep only these."""
        for name in self.keys() - set(names):
            del self[name]

    def revise(self, revised: ReviseSpawn) -> None:
        """Use these parameters and, if it is given, this class from the next start on.

        Raises:
            NotHere: No component of this name is here.
        """
        kept = self.get(revised.name)
        if kept is None:
            raise NotHere(f"no component {revised.name} runs here", name=revised.name)
        class_path, parameters = revised.class_path or kept.order.class_path, revised.parameters
        kept.launch = msgspec.structs.replace(kept.launch, parameters=parameters, class_path=class_path)
        kept.order = msgspec.structs.replace(
            kept.order, parameters=parameters, class_path=class_path, declared=revised.declared
        )

    def launch_of(self, name: str) -> Launch | None:
        """Return the launch of a component; None: it is not kept."""
        kept = self.get(name)
        return kept.launch if kept is not None else None

    async def wait_ready(self, name: str) -> int:
        """Return the pid of a starting component when it is ready.

        Raises:
            StartFailed: It did not start.
        """
        ready: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        self._starting.setdefault(name, []).append(ready)
        return await ready

    def ended(self, name: str) -> asyncio.Future[ProcessEnded]:
        """Return the future of a component's end."""
        ended: asyncio.Future[ProcessEnded] = asyncio.get_running_loop().create_future()
        self._ending.setdefault(name, []).append(ended)
        return ended

    def settle(self, report: Report) -> None:
        """Return supervision's report to all callers that wait for it."""
        name = report.name
        match report:
            case ReportReady(pid=pid):
                _settle(self._starting.pop(name, []), pid)
            case ReportStartFailed(how=how):
                failure, waiting = self.failed(name, how), self._starting.pop(name, [])
                if not waiting:  # a hub's failure: raised at the next ``wait_ready``
                    self._failures[name] = failure
                _settle(waiting, failure)
            case ReportEnded(by=by, exit_code=exit_code):
                _settle(self._starting.pop(name, []), self.failed(name, "was ended"))
                _settle(self._ending.pop(name, []), ProcessEnded(name, by, exit_code))
            case ReportLeft():
                _settle(self._starting.pop(name, []), self.failed(name, "ended by itself"))
            case ReportFell(how=how, restart_in_s=restart_in_s) if restart_in_s < 0:
                _settle(self._starting.pop(name, []), self.failed(name, how))

    def failed(self, name: str, how: str) -> StartFailed:
        """Return why the component did not start, with the end of its log."""
        return start_failed(name, how, self.launch_of(name))

    def failure(self, name: str) -> StartFailed | None:
        """Return why a component did not start, if no caller waited for its start."""
        return self._failures.get(name)


def as_spawn(launch: Launch, policy: RestartPolicy, ready_within_s: float) -> Spawn:
    """Return the order that begins this launch."""
    return Spawn(
        launch.subsystem,
        launch.name,
        launch.type,
        launch.class_path,
        launch.parameters,
        launch.requester,
        policy,
        ready_within_s,
        process=launch.process,
    )


def _settle(waiting: list[asyncio.Future[Any]], outcome: object) -> None:
    for future in waiting:
        settle(future, outcome)
