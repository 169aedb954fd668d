"""Registry: who has which name, and who of them is ready.

Events go in (somebody registers, a token rises or falls, a component says who it is), instructions
come out. The caller owns the bus and the clock.

Two tokens tell of every component. Its *claim* rises as soon as it was given its name and carries
host and pid; its *token* proper rises when it is ready. A name is its holder's as long as one of them
stands. Before the claim is seen the name is kept for a moment (``CLAIM_WITHIN_S``). Without claims, a
process that died before it was ready would keep its name from its own successor.

Rules:

* One name, one holder: whoever registers while another's claim or token stands is refused.
* Truth lives at the edge: after the hub's own restart the registry is empty, the tokens come back by
  themselves, and whoever stands behind an unknown one is asked who it is (``Introduce``).
* Readiness is the token, never what a component says of itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import msgspec

from backbone.component.messages import ComponentState, LifeState
from backbone.nameserver.messages import Appeared, Components, Disappeared, NameTaken, UnknownName
from backbone.naming import component_of, did_you_mean

CLAIM_WITHIN_S = 1.0  # chosen: a claim follows its registration within milliseconds; a busy machine has a second


@dataclass(frozen=True, slots=True)
class Announce:
    """Publish this."""

    news: Appeared | Disappeared


@dataclass(frozen=True, slots=True)
class Introduce:
    """Ask the component at this address who and how it is, and report the answer."""

    address: str


Instruction = Announce | Introduce


@dataclass(frozen=True, slots=True)
class _Claim:
    address: str
    host: str
    pid: int


@dataclass(slots=True)
class _Entry:
    """What is known of one name.

    Attributes:
        state: Who it is; None while only its tokens are known.
        given_s: Mission time at which it was given to ``state``.
        claims: Processes that were given it, as their tokens tell; two only if a hub's restart came between.
        tokens: Addresses under which a component of this name is ready.
        announced: Whether ``Appeared`` was told since its token rose.
    """

    state: ComponentState | None = None
    given_s: float = 0.0
    claims: set[_Claim] = field(default_factory=set)
    tokens: set[str] = field(default_factory=set)
    announced: bool = False


class Registry:
    """All names of one mission.

    Args:
        hub_since_s: Mission time at which the hub began to listen.
        reconnect_s: Mission seconds after that in which components of an earlier hub may still come back; 0 if there
            was no earlier hub.
        claim_within_s: Mission seconds for which a name is kept until its holder's claim is seen.
    """

    def __init__(self, hub_since_s: float, reconnect_s: float, claim_within_s: float = CLAIM_WITHIN_S) -> None:
        self._claim_within_s = claim_within_s
        self._hub_since_s, self._complete_from_s = hub_since_s, hub_since_s + reconnect_s
        self._entries: dict[str, _Entry] = {}
        self._introducing: set[str] = set()

    # ------------------------------------------------------------------ events
    def registered(self, newcomer: ComponentState, now_s: float) -> None:
        """Give the name to the newcomer; registering again with the same state changes nothing.

        Raises:
            NameTaken: Another holds the name.
        """
        self._forget_unclaimed(now_s)
        name = component_of(newcomer.address)
        entry = self._entries.setdefault(name, _Entry())
        if entry.state is not None and _same_process(entry.state, newcomer) and entry.state.since_s == newcomer.since_s:
            entry.given_s = now_s
            return
        holder = _holder(entry)
        if holder is not None:
            raise NameTaken(
                f"{name} is {holder.address} on {holder.host or 'a host not yet known'}, pid {holder.pid or 'unknown'}",
                name=name,
                address=holder.address,
                host=holder.host,
                pid=holder.pid,
            )
        entry.state, entry.given_s = newcomer, now_s

    def claim_changed(self, address: str, host: str, pid: int, *, stands: bool) -> None:
        """Take note that a process claims a name, or no longer does."""
        name, claim = component_of(address), _Claim(address, host, pid)
        if stands:
            self._entries.setdefault(name, _Entry()).claims.add(claim)
        elif name in self._entries:
            self._entries[name].claims.discard(claim)
            self._forget_if_gone(name)

    def token_changed(self, address: str, *, stands: bool, now_s: float) -> list[Instruction]:
        """Take note that a component became ready, or is no longer."""
        name = component_of(address)
        if not stands:
            return self._token_fell(name, address, now_s)
        entry = self._entries.setdefault(name, _Entry())
        entry.tokens.add(address)
        if entry.state is None or entry.state.address != address:
            self._introducing.add(address)
            return [Introduce(address)]
        entry.state = msgspec.structs.replace(entry.state, state=LifeState.READY, since_s=now_s)
        entry.announced = True
        return [Announce(Appeared(entry.state)), Introduce(address)]

    def introduced(self, state: ComponentState) -> list[Instruction]:
        """Take over what a component whose token stands says of itself."""
        self._introducing.discard(state.address)
        entry = self._entries.get(component_of(state.address))
        if entry is None or state.address not in entry.tokens:
            return []
        entry.state = state
        if entry.announced:
            return []
        entry.announced = True
        return [Announce(Appeared(state))]

    def introduction_failed(self, address: str) -> None:
        """Stop counting on this component's answer for a complete list; its token may stand for a hung process."""
        self._introducing.discard(address)

    def status_heard(self, state: ComponentState) -> None:
        """Take over the published state of a ready component, so that lists show its feedback."""
        entry = self._entries.get(component_of(state.address))
        if (
            entry is not None
            and state.address in entry.tokens
            and entry.state is not None
            and _same_process(entry.state, state)
        ):
            entry.state = state

    # ------------------------------------------------------------------ questions
    def is_unknown(self, address: str) -> bool:
        """Say whether a token stands at this address and nobody knows yet whose it is."""
        entry = self._entries.get(component_of(address))
        return entry is not None and address in entry.tokens and (entry.state is None or entry.state.address != address)

    def resolve(self, name: str, now_s: float) -> ComponentState:
        """Return who has this name.

        Raises:
            UnknownName: Nobody, or (``complete`` False in the facts) nobody yet since the hub's restart.
        """
        self._forget_unclaimed(now_s)
        entry = self._entries.get(name)
        if entry is not None and entry.state is not None:
            return entry.state
        complete = self._is_complete(now_s)
        known = [other for other, entry in self._entries.items() if entry.state is not None]
        yet = "" if complete else "; the hub began a moment ago and components still come back"
        raise UnknownName(
            f"nobody is registered as {name!r}{did_you_mean(name, known)}{yet}", name=name, complete=complete
        )

    def components(self, subsystem: str, type: str, now_s: float) -> Components:  # noqa: A002  the paper's word
        """Return who is registered, sorted by address; empty arguments match all."""
        self._forget_unclaimed(now_s)
        found = [
            state
            for state in self.states()
            if (not subsystem or state.address.startswith(f"{subsystem}/")) and (not type or state.type == type)
        ]
        unknown = sorted(address for entry in self._entries.values() for address in entry.tokens)
        unknown = [address for address in unknown if address.startswith(subsystem) and self.is_unknown(address)]
        return Components(found, self._is_complete(now_s), self._hub_since_s, unknown)

    def states(self) -> Iterator[ComponentState]:
        """Yield everybody who is registered, sorted by address."""
        known = (entry.state for entry in self._entries.values() if entry.state is not None)
        return iter(sorted(known, key=lambda state: state.address))

    def _is_complete(self, now_s: float) -> bool:
        return now_s >= self._complete_from_s and not self._introducing

    # ------------------------------------------------------------------
    def _token_fell(self, name: str, address: str, now_s: float) -> list[Instruction]:
        self._introducing.discard(address)
        entry = self._entries.get(name)
        if entry is None or address not in entry.tokens:
            return []
        entry.tokens.discard(address)
        told: list[Instruction] = []
        if entry.state is not None and entry.state.address == address:
            if entry.announced:
                told = [Announce(Disappeared(address))]
            entry.announced = False
            entry.state = msgspec.structs.replace(entry.state, state=LifeState.DRAINING, since_s=now_s)
        self._forget_if_gone(name)
        return told

    def _forget_if_gone(self, name: str) -> None:
        entry = self._entries[name]
        if not entry.tokens and not entry.claims:
            del self._entries[name]

    def _forget_unclaimed(self, now_s: float) -> None:
        """Forget whoever was given a name and died before its claim was seen."""
        for name, entry in list(self._entries.items()):
            if not entry.tokens and not entry.claims and now_s >= entry.given_s + self._claim_within_s:
                del self._entries[name]


def _holder(entry: _Entry) -> ComponentState | None:
    """Return who holds the name; with an empty type if only its tokens are known yet."""
    if entry.state is not None:
        return entry.state
    if entry.claims:
        claim = min(entry.claims, key=lambda claim: (claim.address, claim.host, claim.pid))
        return ComponentState(claim.address, "", claim.host, claim.pid, LifeState.CONNECTING, 0.0)
    if entry.tokens:
        return ComponentState(min(entry.tokens), "", "", 0, LifeState.READY, 0.0)
    return None


def _same_process(one: ComponentState, other: ComponentState) -> bool:
    return (one.address, one.host, one.pid) == (other.address, other.host, other.pid)
