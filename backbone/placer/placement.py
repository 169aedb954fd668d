"""Placement: the choice of a host for one more component, with a reason for each host.

Rules:

* The creator of the host must live, and the host must have every needed tag. If the order names a host, only that
  host is possible.
* Members of a shared process go to the host of its first member, unless the order names a host.
* Among the possible hosts the placer chooses the host with the least load: components per core, with a busy processor
  counted as further components. So equal hosts get equal numbers of components, and a busy host gets fewer.
* A host on which a component of this type did not start comes after all others, because the class may be missing there.
* Hosts of equal load are chosen in the order of their names, so the same state gives the same choice.
* Every answer, also a refusal, has one line for every host.

Source: S000, "component placer": processes go to a host that has the hardware and the least load.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

from backbone.naming import did_you_mean
from backbone.placer.messages import NoHost
from backbone.spoken import counted

BUSY_AS_COMPONENTS = 8.0  # chosen: on a saturated host one more component costs like eight on an idle one
BUSY_STEPS = 4  # chosen: quarters; below an eighth a processor counts as idle, so that noise does not steer
FULL_MEMORY = 0.9  # chosen: swapping begins soon; such a host counts as saturated, but may still be the only one


@dataclass(frozen=True, slots=True)
class CandidateHost:
    """A host as the placer sees it.

    Attributes:
        name: Name in the mission file.
        alive: True while its creator's token exists.
        components: Number of its components, starting ones included.
        cpu: Busy share of all cores, 0 to 1, as last published by its creator.
        memory: Used share of memory, 0 to 1.
        failed_s: Mission time at which a component of this type last failed to start here; negative: none did.
    """

    name: str
    tags: frozenset[str] = frozenset()
    alive: bool = True
    components: int = 0
    cpu: float = 0.0
    memory: float = 0.0
    cores: int = 1
    failed_s: float = -1.0

    @property
    def load(self) -> float:
        """Components per core with one more component, a busy processor counted as components."""
        busy = 1.0 if self.memory > FULL_MEMORY else round(self.cpu * BUSY_STEPS) / BUSY_STEPS
        return (self.components + 1) / max(1, self.cores) + busy * BUSY_AS_COMPONENTS

    def describe(self) -> str:
        """Return its load in words."""
        return (
            f"{counted(self.components, 'component')} on {counted(self.cores, 'core')}, "
            f"processor {self.cpu:.0%} and memory {self.memory:.0%} in use"
        )


@dataclass(frozen=True, slots=True)
class Choice:
    """The chosen host.

    Attributes:
        host: The host's name.
        reasons: One line for each host, sorted by host: why it was chosen or not.
    """

    host: str
    reasons: tuple[str, ...]


def place(name: str, tags: Collection[str], pin: str, hosts: Iterable[CandidateHost], colocation: str = "") -> Choice:
    """Return the host for one more component.

    Args:
        tags: Tags that the host must have.
        pin: The only possible host; empty: any.
        colocation: Host of the other members of its process; empty: none.

    Raises:
        NoHost: No host is possible; the detail has a line for each host.
    """
    known = sorted(hosts, key=lambda host: host.name)
    colocation = "" if pin else colocation
    obstacles = {host.name: obstacle(host, tags, pin, colocation) for host in known}
    able = [host for host in known if not obstacles[host.name]]
    if not able:
        raise NoHost(_no_host(name, pin, known, obstacles), name=name)
    chosen = min(able, key=lambda host: (host.failed_s, host.load, host.name))

    def reason(host: CandidateHost) -> str:
        if host is chosen:
            why = "asked for" if pin else "with the rest of its process" if colocation else "least loaded"
            return f"{host.name}: chosen, {why}: {host.describe()}"
        if obstacles[host.name]:
            return f"{host.name}: {obstacles[host.name]}"
        if host.failed_s > chosen.failed_s:
            return f"{host.name}: a component of this type did not start there"
        return f"{host.name}: {'more loaded' if host.load > chosen.load else 'as loaded'}: {host.describe()}"

    return Choice(chosen.name, tuple(reason(host) for host in known))


def obstacle(host: CandidateHost, tags: Collection[str], pin: str, colocation: str = "") -> str:
    """Return why this host is impossible, empty if it is possible."""
    if pin and host.name != pin:
        return f"not {pin}, which was asked for"
    if colocation and host.name != colocation:
        return f"not {colocation}, where the rest of its process is"
    missing = sorted(set(tags) - host.tags)
    if missing:
        return f"lacks {', '.join(missing)}"
    return "" if host.alive else "its creator is gone"


def _no_host(name: str, pin: str, known: list[CandidateHost], obstacles: dict[str, str]) -> str:
    if not known:
        return f"no host for {name}: no creator is known"
    lines = "; ".join(f"{host.name}: {obstacles[host.name]}" for host in known)
    names = [host.name for host in known]
    unknown = f"{pin} is no host with a creator{did_you_mean(pin, names)}; " if pin and pin not in names else ""
    return f"no host for {name}: {unknown}{lines}"
