"""Placement: which host gets the next component, and why not the others.

Rules:

* A host must be there (its creator lives), be the one asked for if one is, and have every tag needed.
* Those who share a process go where the first of them is, unless another host is asked for.
* Among those the least burdened is chosen: components per core, with a busy processor counting like
  further components. Equal hosts so get equal numbers, a loaded one gets fewer.
* Equally burdened hosts are taken in the order of their names, so the same state gives the same choice.
* Every answer, also a refusal, has one line for every host.

Source: S000, "component placer": processes go to a host that has the hardware and the least load.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

from backbone.naming import did_you_mean
from backbone.placer.messages import NoHost

BUSY_AS_COMPONENTS = 8.0  # chosen: on a saturated host one more component costs like eight on an idle one
BUSY_STEPS = 4  # chosen: quarters; below an eighth a processor counts as idle, so that noise does not steer
FULL_MEMORY = 0.9  # chosen: swapping begins soon; such a host counts as saturated, but may still be the only one


@dataclass(frozen=True, slots=True)
class HostView:
    """A host as the placer sees it.

    Attributes:
        name: Name in the mission file.
        tags: What it has.
        alive: True while its creator's token stands.
        components: Placed there, those just starting included.
        cpu: Busy share of all cores, 0 to 1, as its creator told last.
        memory: Used share of memory, 0 to 1.
        cores: Number of cores.
    """

    name: str
    tags: frozenset[str] = frozenset()
    alive: bool = True
    components: int = 0
    cpu: float = 0.0
    memory: float = 0.0
    cores: int = 1

    @property
    def load(self) -> float:
        """Components per core this host would have with one more, a busy processor counted as components."""
        busy = 1.0 if self.memory > FULL_MEMORY else round(self.cpu * BUSY_STEPS) / BUSY_STEPS
        return (self.components + 1) / max(1, self.cores) + busy * BUSY_AS_COMPONENTS

    def describe(self) -> str:
        """Say how burdened it is, for people."""
        return (
            f"{self.components} components on {self.cores} cores, "
            f"processor {self.cpu:.0%} and memory {self.memory:.0%} in use"
        )


@dataclass(frozen=True, slots=True)
class Choice:
    """Where the component goes.

    Attributes:
        host: The host's name.
        reasons: One line a host, sorted by host: why it was chosen or not.
    """

    host: str
    reasons: tuple[str, ...]


def place(name: str, tags: Collection[str], pin: str, hosts: Iterable[HostView], colocation: str = "") -> Choice:
    """Return the host for one more component.

    Args:
        name: Of the component, for the refusal.
        tags: Every one must be on the host.
        pin: The only host allowed; empty: any.
        hosts: All that are known; their order does not matter.
        colocation: Where those are with whom it shares its process; empty: nowhere.

    Raises:
        NoHost: None can take it; the detail has a line for each.
    """
    known = sorted(hosts, key=lambda host: host.name)
    colocation = "" if pin else colocation
    obstacles = {host.name: obstacle(host, tags, pin, colocation) for host in known}
    able = [host for host in known if not obstacles[host.name]]
    if not able:
        raise NoHost(_nobody(name, pin, known, obstacles), name=name)
    chosen = min(able, key=lambda host: (host.load, host.name))

    def reason(host: HostView) -> str:
        if host is chosen:
            why = "asked for" if pin else "with the rest of its process" if colocation else "least burdened"
            return f"{host.name}: chosen, {why}: {host.describe()}"
        if obstacles[host.name]:
            return f"{host.name}: {obstacles[host.name]}"
        return f"{host.name}: {'more burdened' if host.load > chosen.load else 'as burdened'}: {host.describe()}"

    return Choice(chosen.name, tuple(reason(host) for host in known))


def obstacle(host: HostView, tags: Collection[str], pin: str, colocation: str = "") -> str:
    """Return why this host cannot take it, empty if it can."""
    if pin and host.name != pin:
        return f"not {pin}, which was asked for"
    if colocation and host.name != colocation:
        return f"not {colocation}, where the rest of its process is"
    missing = sorted(set(tags) - host.tags)
    if missing:
        return f"lacks {', '.join(missing)}"
    return "" if host.alive else "its creator is gone"


def _nobody(name: str, pin: str, known: list[HostView], obstacles: dict[str, str]) -> str:
    if not known:
        return f"no host for {name}: no creator has been heard of"
    lines = "; ".join(f"{host.name}: {obstacles[host.name]}" for host in known)
    names = [host.name for host in known]
    unknown = f"{pin} is no host with a creator{did_you_mean(pin, names)}; " if pin and pin not in names else ""
    return f"no host for {name}: {unknown}{lines}"
