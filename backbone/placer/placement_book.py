"""Placement book: the host of each component, and the decisions when a host is lost or returns.

Events go in, instructions come out. The caller owns the bus and the clock.

Rules:

* A name is in the book once, from its admission on. So two starts never get the same name, and each choice of a host
  counts the components that are still starting.
* The creators are the source of truth: a creator's list of processes decides which components its host has. A restarted
  placer rebuilds its book from these lists.
* A record is a wish: it exists until an order stops its component. A missing component is placed again, whether its
  host was lost or it ended without an order. Only components without restart (ARCs) are forgotten, because their
  owners claim new ones.
* When a creator dies, its components die with it. Pinned components wait until their creator is back.
* The book remembers each order to stop, so that owners do not start the component again when they find it missing.
* A silent host may only be cut off and run on for a while. Its components are *fenced*: see ``fences``.
* A host that was cut off may return with components that were stopped meanwhile. The placer ends these orphans.

If a creator dies before it answers a start, the start stays in the book: the component goes to another host or waits
for that creator, and then its requester gets the answer.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import msgspec

from backbone.component.messages import Absence, NameTaken
from backbone.component_database.messages import ComponentType, Multiplicity, MultiplicityExceeded
from backbone.creator.messages import HostLoad, ProcessState, Spawn
from backbone.naming import Subsystem, did_you_mean
from backbone.placer.decisions import EndOrphan, Inspect, Instruction, Note, PlaceAgain, PlacementPhase, PlacementRecord
from backbone.placer.fences import Fences
from backbone.placer.messages import NotPlaced
from backbone.placer.packing import is_packed, joined, whole
from backbone.placer.placement import CandidateHost, Choice, obstacle, place

STOPPED_KEPT = 1000  # chosen: owners compare every few seconds; no mission stops so many in that time


@dataclass(slots=True)
class _Host:
    """One host: the placer's view of it without the count of components, and the start of its creator."""

    view: CandidateHost
    creator_start: int
    inspected: tuple[int, int] = (-1, -1)
    """Counts of components, by its creator and by the book, after the last inspection."""


class PlacementBook:
    """All placements and hosts of one mission.

    Args:
        packs: Number of shared processes into which a host packs components, see ``packing``.
    """

    def __init__(self, packs: int = 0) -> None:
        self._packs = max(1, packs)
        self._hosts: dict[str, _Host] = {}
        self._records: dict[str, PlacementRecord] = {}
        self._numbers: dict[str, int] = {}
        self._left_behind: set[tuple[str, str]] = set()
        self._stopped: dict[str, str] = {}
        self.fences = Fences(self.is_alive)
        self._failed_s: dict[tuple[str, str], float] = {}

    def record(self, name: str) -> PlacementRecord:
        """Return the record of this name.

        Raises:
            NotPlaced: The book has no record of this name.
        """
        found = self._records.get(name)
        if found is None:
            stopped = self._stopped.get(name, "")
            told = f"was stopped, {stopped}" if stopped else f"was not placed{did_you_mean(name, self._records)}"
            raise NotPlaced(f"{name!r} {told}", name=name, stopped=name in self._stopped)
        return found

    def find(self, name: str) -> PlacementRecord | None:
        """Return the record of this name, or None."""
        return self._records.get(name)

    def records(self) -> list[PlacementRecord]:
        """Return all records, sorted by name."""
        return [self._records[name] for name in sorted(self._records)]

    def hosts(self) -> list[CandidateHost]:
        """Return every host with its count of components, sorted by name."""
        counts: dict[str, int] = {}
        for record in self._records.values():
            counts[record.host] = counts.get(record.host, 0) + 1
        return [replace(self._hosts[name].view, components=counts.get(name, 0)) for name in sorted(self._hosts)]

    def is_alive(self, host: str) -> bool:
        """Return whether this host's creator is alive."""
        return host in self._hosts and self._hosts[host].view.alive

    def knows_creator(self, host: str, start: int) -> bool:
        """Return whether the host's living creator has this start."""
        return self.is_alive(host) and self._hosts[host].creator_start == start

    def may_find_host(self, name: str) -> bool:
        """Return whether the return of a creator would make a host possible; True if no host is known."""
        record = self.record(name)
        revived = [replace(view, alive=True) for view in self.hosts()]
        return not revived or any(not obstacle(view, record.spawn.tags, record.pin) for view in revived)

    def stopped(self) -> dict[str, str]:
        """Return the names that were ordered to stop and were not started since, with the reason."""
        return dict(self._stopped)

    def owned_by(self, owner: str) -> list[str]:
        """Return the names of this owner's components."""
        return [record.spawn.name for record in self.records() if record.spawn.requester == owner]

    def ownerless(self) -> dict[str, list[str]]:
        """Return the names whose owner is a decision process that is not in the book, by the owner's address."""
        known = {record.address for record in self._records.values()}
        found: dict[str, list[str]] = {}
        for record in self.records():
            owner = record.spawn.requester
            if owner.startswith(f"{Subsystem.MISSION_CONTROL}/") and owner not in known:
                found.setdefault(owner, []).append(record.spawn.name)
        return found

    def absences(self) -> list[Absence]:
        """Return the wanted components that ran and have no host now. Creators report components that they restart."""
        return [
            Absence(record.spawn.name, record.missing_since_s, record.cause, record.doing, record.remedy)
            for record in self.records()
            if record.missing_since_s >= 0 and not record.unwanted
        ]

    def number(self, type_name: str) -> str:
        """Return ``<type>-<n>`` with a new n; numbers only grow, so the stories of two components never mix."""
        self._numbers[type_name] = self._numbers.get(type_name, 0) + 1
        return f"{type_name}-{self._numbers[type_name]}"

    def refuse_second(self, component_type: ComponentType, name: str) -> None:
        """Return unless the type may run only once and another name of it is in the book.

        The nameserver does not know a component that waits for its restart or for a host; the book does.

        Raises:
            MultiplicityExceeded: Another name of this type is in the book.
        """
        if component_type.multiplicity is Multiplicity.MANY:
            return
        for record in self.records():
            other = record.spawn
            if other.type == component_type.name and other.name != name:
                raise MultiplicityExceeded(
                    f"{name}: only one {other.type} may run, and {other.name} is {record.phase} on "
                    f"{record.host or 'no host yet'}, pid {record.pid}",
                    name=other.name,
                    host=record.host,
                    pid=record.pid,
                )

    def reserve(self, spawn: Spawn, pin: str, now_s: float) -> PlacementRecord:
        """Enter a new component without a host yet.

        Raises:
            NameTaken: The name is in the book.
        """
        taken = self._records.get(spawn.name)
        if taken is not None:
            raise NameTaken(
                f"{spawn.name} is {taken.phase} on {taken.host or 'no host yet'}, asked for by {taken.spawn.requester}",
                name=spawn.name,
                host=taken.host,
                pid=taken.pid,
            )
        self._remember_number(spawn)
        self.fences.name_entered(spawn.name)
        self._stopped.pop(spawn.name, None)
        record = self._records[spawn.name] = PlacementRecord(spawn, pin, PlacementPhase.STARTING, "", now_s)
        return record

    def choose(self, name: str, now_s: float) -> Choice:
        """Choose a host for the component; from now on the component counts there.

        Raises:
            NoHost: No host is possible.
        """
        record = self.record(name)
        record.host = ""  # it must not count on the host that it leaves
        failed_s = self._failed_s
        hosts = [replace(one, failed_s=failed_s.get((one.name, record.spawn.type), -1.0)) for one in self.hosts()]
        choice = place(name, record.spawn.tags, record.pin, hosts, colocation=self._colocation(record))
        there = [one.spawn for one in self._records.values() if one is not record and one.host == choice.host]
        record.spawn = msgspec.structs.replace(record.spawn, process=joined(record.spawn, there, self._packs))
        record.phase, record.host = PlacementPhase.STARTING, choice.host
        record.reasons, record.since_s = choice.reasons, now_s
        record.pid, record.lost = 0, False
        return choice

    def started(self, name: str, pid: int, now_s: float) -> None:
        """Record that the component is ready."""
        record = self.record(name)
        record.phase, record.since_s = PlacementPhase.RUNNING, now_s
        record.runs(pid)
        self._failed_s.pop((record.host, record.spawn.type), None)

    def failed(self, name: str, now_s: float) -> None:
        """Record that the component did not start on its host: other hosts come first for its type."""
        record = self.record(name)
        self._failed_s[record.host, record.spawn.type] = now_s

    def unsure(self, name: str, now_s: float) -> None:
        """Record that it is unknown whether the component runs; its creator's next list decides."""
        record = self.record(name)
        record.phase, record.since_s, record.suspect = PlacementPhase.RUNNING, now_s, True

    def waits(self, name: str, why: str = "") -> None:
        """Record that no host is possible now."""
        record = self.record(name)
        record.phase, record.host, record.doing = PlacementPhase.WAITING, "", f"waits for a host: {why}"

    def forget(self, name: str) -> None:
        """Remove the name from the book. Idempotent."""
        self._records.pop(name, None)

    def stop_ordered(self, name: str, reason: str) -> None:
        """Remove the name from the book and remember the order to stop it."""
        self.forget(name)
        self._stopped.pop(name, None)
        self._stopped[name] = reason
        while len(self._stopped) > STOPPED_KEPT:
            del self._stopped[next(iter(self._stopped))]

    def creator_up(
        self, host: str, tags: Collection[str], creator_start: int, processes: Collection[ProcessState], asked_s: float
    ) -> list[Instruction]:
        """Enter a creator's answer to a question of that mission time, and place waiting components again."""
        instructions: list[Instruction] = []
        if self.is_alive(host) and not self.knows_creator(host, creator_start):
            instructions += self.creator_down(host, asked_s)
        old = self._hosts[host].view if host in self._hosts else CandidateHost(host)
        if not self.is_alive(host):
            instructions.append(Note(host, f"has a creator; its tags: {', '.join(sorted(tags)) or 'none'}"))
        self._hosts[host] = _Host(replace(old, tags=frozenset(tags), alive=True), creator_start)
        for process in processes:
            instructions += self._found(host, process, asked_s)
        self._left_behind = {(where, name) for where, name in self._left_behind if where != host}
        self._failed_s = {at: at_s for at, at_s in self._failed_s.items() if at[0] != host}
        instructions += self.inspected(host, processes, asked_s)
        return instructions + [
            PlaceAgain(record.spawn.name)
            for record in self.records()
            if record.phase is PlacementPhase.WAITING and not record.unwanted
        ]

    def creator_down(self, host: str, now_s: float, fence_s: float = 0.0) -> list[Instruction]:
        """Record that a host's creator died with all its components.

        Args:
            fence_s: Mission seconds for which the host may still run them, because its death was not observed.
        """
        if not self.is_alive(host):
            return []
        known = self._hosts[host]
        known.view = replace(known.view, alive=False)
        instructions: list[Instruction] = [Note(host, "lost its creator and all its components")]
        remedy = f"check the link to {host}, or offer it again" if fence_s > 0 else ""
        for record in self.records():
            if record.host != host:
                continue
            name = record.spawn.name
            self._left_behind.add((host, name))
            if fence_s > 0:
                self.fences.host_lost(name, host, now_s + fence_s)
            if record.phase is PlacementPhase.STARTING:
                continue  # the task that starts it detects the loss and decides
            if record.phase is PlacementPhase.RUNNING and record.spawn.policy.restart and not record.unwanted:
                record.misses(f"was lost with the creator of {host}", now_s, remedy)
                record.lost = True
                instructions += [Note(name, f"was lost with {host}"), PlaceAgain(name)]
            else:
                self.forget(name)
                instructions.append(Note(name, f"was lost with {host} and is not started again"))
        return instructions

    def load_heard(self, load: HostLoad) -> list[Instruction]:
        """Record a host's load; inspect the creator while its count of components differs from the book's."""
        known = self._hosts.get(load.host)
        if known is None:
            return []
        known.view = replace(
            known.view, tags=frozenset(load.tags), cpu=load.cpu, memory=load.memory, cores=max(1, load.cores)
        )
        here = [record for record in self._records.values() if record.host == load.host]
        if any(record.suspect for record in here):
            return [Inspect(load.host)]
        settled = all(record.phase is not PlacementPhase.STARTING for record in here)
        if settled and load.components != len(here) and (load.components, len(here)) != known.inspected:
            return [Inspect(load.host)]
        return []

    def component_disappeared(self, component_address: str) -> list[Instruction]:
        """Record the end of a token; the creator knows whether its component has ended or is being restarted."""
        for record in self._records.values():
            if record.address == component_address and record.phase is PlacementPhase.RUNNING and not record.unwanted:
                record.suspect = True
                return [Inspect(record.host)]
        return []

    def component_appeared(self, component_address: str, host: str, pid: int) -> None:
        """Record that a component is ready again."""
        for record in self._records.values():
            if (record.address, record.host) == (component_address, host) and record.phase is PlacementPhase.RUNNING:
                record.runs(pid)

    def inspected(self, host: str, processes: Collection[ProcessState], asked_s: float) -> list[Instruction]:
        """Update the records of this host from its creator's answer to a question of that mission time."""
        listed = {process.spawn.name: process for process in processes}
        instructions: list[Instruction] = []
        for record in self.records():
            name = record.spawn.name
            if record.host != host or record.phase is not PlacementPhase.RUNNING or record.since_s > asked_s:
                continue
            process = listed.get(name)
            if process is not None:
                if process.pid:
                    record.runs(process.pid)
            elif record.unwanted or not record.spawn.policy.restart:
                self.forget(name)
                instructions.append(Note(name, f"ended on {host}"))
            else:
                record.misses(f"its creator on {host} does not have it", asked_s)
                instructions += [Note(name, f"is missing on {host}"), PlaceAgain(name)]
        if host in self._hosts:
            self._hosts[host].inspected = len(listed), sum(record.host == host for record in self.records())
        return instructions

    def _colocation(self, record: PlacementRecord) -> str:
        """Return the host of the other members of its process; empty: no other member has a host."""
        spawn = record.spawn
        if not spawn.process or is_packed(spawn.process) or spawn.alike_most > 1:
            return ""
        hosts = [
            other.host
            for other in self.records()
            if other is not record and whole(other.spawn.process) == whole(spawn.process) and self.is_alive(other.host)
        ]
        return hosts[0] if hosts else ""

    def _found(self, host: str, process: ProcessState, asked_s: float) -> list[Instruction]:
        """Update the book from one process of a creator's list."""
        spawn, record = process.spawn, self._records.get(process.spawn.name)
        if record is None:
            if (host, spawn.name) in self._left_behind or spawn.name in self._stopped:
                return [EndOrphan(host, spawn.name), Note(spawn.name, f"came back with {host}, no longer wanted")]
            self._remember_number(spawn)
            record = PlacementRecord(spawn, host if spawn.pinned else "", PlacementPhase.RUNNING, host, asked_s)
            self._records[spawn.name] = record
            record.is_on(host, process.pid, asked_s)
            return [Note(spawn.name, f"was found on {host}")]
        if record.host == host:
            return []
        is_meant = record.lost or (not record.host and record.pin in ("", host) and _are_alike(record.spawn, spawn))
        if is_meant and not record.unwanted:
            record.is_on(host, process.pid, asked_s)
            return [Note(spawn.name, f"came back with {host}")]
        return [EndOrphan(host, spawn.name), Note(spawn.name, f"came back with {host}, but is wanted elsewhere")]

    def _remember_number(self, spawn: Spawn) -> None:
        """Never use the number of a present or former name again."""
        type_name, _, number = spawn.name.rpartition("-")
        if type_name == spawn.type and number.isdecimal():
            self._numbers[type_name] = max(self._numbers.get(type_name, 0), int(number))


def _are_alike(one: Spawn, other: Spawn) -> bool:
    """Return whether the same owner wants the same of both orders."""
    return (one.requester, one.type, one.class_path, one.parameters) == (
        other.requester,
        other.type,
        other.class_path,
        other.parameters,
    )
