"""Fences: the names that a silent host may still run, and until when.

A host that is cut off runs its components on for some seconds. A name is *fenced* meanwhile: it starts nowhere, until
the host has ended it by itself, or has listed its processes again.

A restarted placer does not know which components a silent host has. Therefore each name that no living host has listed
is fenced while an earlier host of the mission is missing.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class _Fence:
    hosts: frozenset[str]
    until_s: float


class Fences:
    """All fences of one mission; times are mission seconds.

    Args:
        is_alive: Returns whether the creator of this host is alive.
    """

    def __init__(self, is_alive: Callable[[str], bool]) -> None:
        self._is_alive = is_alive
        self._by_name: dict[str, _Fence] = {}
        self._for_new_names = _Fence(frozenset(), 0.0)

    def after_restart(self, earlier_hosts: Collection[str], until_s: float) -> None:
        """Fence each new name while one of these hosts is missing, because that host may run it."""
        self._for_new_names = _Fence(frozenset(earlier_hosts), until_s)

    def name_entered(self, name: str) -> None:
        """Record a name that no living host has listed."""
        if self._for_new_names.hosts and name not in self._by_name:
            self._by_name[name] = self._for_new_names

    def host_lost(self, name: str, host: str, until_s: float) -> None:
        """Record that this component's host fell silent."""
        self._by_name[name] = _Fence(frozenset({host}), until_s)

    def until_s(self, name: str, now_s: float) -> float | None:
        """Return the time until which a silent host may still run this component; None: no host may."""
        fence = self._by_name.get(name)
        if fence is None:
            return None
        if fence.until_s > now_s and not all(map(self._is_alive, fence.hosts)):
            return fence.until_s
        del self._by_name[name]
        return None

    def hosts(self, name: str) -> frozenset[str]:
        """Return the hosts that fence this name."""
        fence = self._by_name.get(name)
        return frozenset() if fence is None else fence.hosts
