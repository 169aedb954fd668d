"""Registry: the holder of each name, and whether it is ready.

Events go in (a component registers or introduces itself, a token begins or ends), instructions come out. The caller
owns the bus and the clock.

Every component declares two tokens: its *claim*, which names its incarnation, after its registration, and its
liveliness *token* when it is ready. A component holds its name while one of them exists. Until the claim exists, the
registry keeps the name for ``CLAIM_WITHIN_S``. Without claims, a process that died before its readiness would block the
name for its successor.

Rules:

* One name, one holder: a registration is refused while the claim or token of another component exists.
* The components are the only source of truth: after a restart of the hub the registry is empty, tokens return by
  themselves, and the registry asks the component of each unknown token for its state (``Introduce``).
* Only the token means readiness, never a component's own state.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import msgspec

from backbone.component.messages import ComponentState, LastStop, LifeState, NameTaken
from backbone.incarnation import Incarnation
from backbone.nameserver.messages import Appeared, Components, Disappeared, UnknownName
from backbone.naming import component_of, did_you_mean

CLAIM_WITHIN_S = 1.0  # chosen: a claim follows its registration within milliseconds, on a busy machine within a second


@dataclass(frozen=True, slots=True)
class Announce:
    """Publish this."""

    news: Appeared | Disappeared


@dataclass(frozen=True, slots=True)
class Introduce:
    """Ask the component at this address for its state, and report the answer."""

    address: str


Instruction = Announce | Introduce


@dataclass(frozen=True, slots=True)
class _Claim:
    address: str
    holder: Incarnation


@dataclass(slots=True)
class _Entry:
    """The registry's record of one name.

    Attributes:
        state: Its holder; None while only tokens are known.
        given_s: Mission time of the registration.
        claims: Components with a claim to the name; two only after a restart of the hub.
        tokens: Addresses under which a component of this name is ready.
        announced: True if ``Appeared`` was published for its present token.
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
        reconnect_s: Mission seconds after that in which components of an earlier hub may reconnect; 0 without an
            earlier hub.
        claim_within_s: Mission seconds for which a name is kept until its holder declares its claim.
        stops: Last emergency stops that an earlier hub knew, by the name of the component.
        otherwise: Last stop of each component whose state no hub knows; None: it was never stopped.
    """

    def __init__(
        self,
        hub_since_s: float,
        reconnect_s: float,
        claim_within_s: float = CLAIM_WITHIN_S,
        stops: Mapping[str, LastStop] | None = None,
        otherwise: LastStop | None = None,
    ) -> None:
        self._claim_within_s = claim_within_s
        self._hub_since_s, self._complete_from_s = hub_since_s, hub_since_s + reconnect_s
        self._entries: dict[str, _Entry] = {}
        self._introducing: set[str] = set()
        self._stops: dict[str, LastStop] = {**(stops or {})}
        self._otherwise = otherwise

    def registered(self, newcomer: ComponentState, now_s: float) -> None:
        """Register the newcomer under its name. Idempotent for the same state.

        Raises:
            NameTaken: Another component holds the name.
        """
        self._forget_unclaimed(now_s)
        name = component_of(newcomer.address)
        entry = self._entries.setdefault(name, _Entry())
        if entry.state is not None and _is_same(entry.state, newcomer) and entry.state.since_s == newcomer.since_s:
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

    def claim_changed(self, address: str, holder: Incarnation, *, stands: bool) -> None:
        """Record that a claim began or ended."""
        name, claim = component_of(address), _Claim(address, holder)
        if stands:
            self._entries.setdefault(name, _Entry()).claims.add(claim)
        elif name in self._entries:
            self._entries[name].claims.discard(claim)
            self._forget_if_gone(name)

    def token_changed(self, address: str, *, stands: bool, now_s: float) -> list[Instruction]:
        """Record that a liveliness token began or ended."""
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
        """Record the state of a component whose token exists."""
        self._introducing.discard(state.address)
        entry = self._entries.get(component_of(state.address))
        if entry is None or state.address not in entry.tokens:
            return []
        if _is_held_by_another(entry, state):  # this one was cut off when its name was given away
            return []
        self._record(entry, state)
        if entry.announced:
            return []
        entry.announced = True
        return [Announce(Appeared(state))]

    def introduction_failed(self, address: str) -> None:
        """Stop waiting for this component's answer, because its process may hang."""
        self._introducing.discard(address)

    def status_published(self, state: ComponentState) -> None:
        """Record the published state of a ready component, so that lists show its feedback."""
        entry = self._entries.get(component_of(state.address))
        if (
            entry is not None
            and state.address in entry.tokens
            and entry.state is not None
            and _is_same(entry.state, state)
        ):
            self._record(entry, state)

    def last_stop(self, name: str) -> LastStop:
        """Return the last emergency stop of the component of this name, or of the former one."""
        return self._stops.get(name, self._otherwise or LastStop())

    def last_stops(self) -> dict[str, LastStop]:
        """Return the last emergency stops by the name of the component."""
        return dict(self._stops)

    def is_unknown(self, address: str) -> bool:
        """Return whether a token exists at this address without a known component."""
        entry = self._entries.get(component_of(address))
        return entry is not None and address in entry.tokens and (entry.state is None or entry.state.address != address)

    def resolve(self, name: str, now_s: float) -> ComponentState:
        """Return the holder of this name.

        Raises:
            UnknownName: No component, or (``complete`` False in the facts) none yet since the hub's restart.
        """
        self._forget_unclaimed(now_s)
        entry = self._entries.get(name)
        if entry is not None and entry.state is not None:
            return entry.state
        complete = self._is_complete(now_s)
        known = [other for other, entry in self._entries.items() if entry.state is not None]
        yet = "" if complete else "; the hub has just restarted and components still reconnect"
        raise UnknownName(
            f"no component is registered as {name!r}{did_you_mean(name, known)}{yet}", name=name, complete=complete
        )

    def components(self, subsystem: str, type: str, now_s: float) -> Components:  # noqa: A002  the paper's word
        """Return the registered components, sorted by address; empty arguments match all."""
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
        """Yield all registered components, sorted by address."""
        known = (entry.state for entry in self._entries.values() if entry.state is not None)
        return iter(sorted(known, key=lambda state: state.address))

    def _is_complete(self, now_s: float) -> bool:
        return now_s >= self._complete_from_s and not self._introducing

    def _record(self, entry: _Entry, state: ComponentState) -> None:
        entry.state, name = state, component_of(state.address)
        if state.stops or self._otherwise is not None:  # kept, because the next one may start on another host
            self._stops[name] = LastStop(state.stops, state.stop)

    def _token_fell(self, name: str, address: str, now_s: float) -> list[Instruction]:
        self._introducing.discard(address)
        entry = self._entries.get(name)
        if entry is None or address not in entry.tokens:
            return []
        entry.tokens.discard(address)
        instructions: list[Instruction] = []
        if entry.state is not None and entry.state.address == address:
            if entry.announced:
                instructions = [Announce(Disappeared(address))]
            entry.announced = False
            entry.state = msgspec.structs.replace(entry.state, state=LifeState.DRAINING, since_s=now_s)
        self._forget_if_gone(name)
        return instructions

    def _forget_if_gone(self, name: str) -> None:
        entry = self._entries[name]
        if not entry.tokens and not entry.claims:
            del self._entries[name]

    def _forget_unclaimed(self, now_s: float) -> None:
        """Forget holders that died before they declared their claim."""
        for name, entry in list(self._entries.items()):
            if not entry.tokens and not entry.claims and now_s >= entry.given_s + self._claim_within_s:
                del self._entries[name]


def _holder(entry: _Entry) -> ComponentState | None:
    """Return the holder of the name, with an empty type while only its tokens are known."""
    if entry.state is not None:
        return entry.state
    if entry.claims:
        claim = min(entry.claims, key=lambda claim: (claim.address, claim.holder))
        host, pid, start = claim.holder
        return ComponentState(claim.address, "", host, pid, LifeState.CONNECTING, 0.0, start=start)
    if entry.tokens:
        return ComponentState(min(entry.tokens), "", "", 0, LifeState.READY, 0.0)
    return None


def _is_held_by_another(entry: _Entry, state: ComponentState) -> bool:
    """Return whether the claim of another component than this one holds the name."""
    holder = entry.state
    return (
        holder is not None
        and not _is_same(holder, state)
        and _Claim(holder.address, holder.incarnation) in entry.claims
    )


def _is_same(one: ComponentState, other: ComponentState) -> bool:
    return (one.address, one.incarnation) == (other.address, other.incarnation)
