"""Invariants that hold after every decision; tests and simulations check them.

Rule of this file: it reads the schedule and changes nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from backbone.scheduling.entries import CONNECTED, ArcEntry, RcEntry
from backbone.scheduling.master_schedule import MasterSchedule
from backbone.scheduling.preemption import understating
from backbone.scheduling.requests import RequestState

Broken = tuple[str, Sequence[ArcEntry]]
"""A broken invariant, and the ARCs concerned."""


def broken(schedule: MasterSchedule, now_s: float) -> Iterator[Broken]:
    """Yield each invariant that does not hold after a decision at this time."""
    arcs = [*schedule.state.arcs.values()]
    for arc in arcs:
        whole = arc.epochs.keys() == arc.uses.keys() if arc.holds else not arc.epochs
        if not whole:
            yield f"{arc.name} holds all its RCs or none", [arc]
        if arc.reservation is not None and arc.state is not RequestState.WAITING:
            yield "only a waiting ARC has a reservation", [arc]
    for rc in schedule.state.rcs.values():
        yield from _broken_of(schedule, rc, [arc for arc in arcs if rc.name in arc.epochs])
    forgotten = schedule.forgotten(now_s)
    if forgotten is not None:
        yield f"the turn of {forgotten.name} is forgotten", [forgotten]


def _broken_of(schedule: MasterSchedule, rc: RcEntry, holders: Sequence[ArcEntry]) -> Iterator[Broken]:
    """Yield the invariants of one RC that do not hold."""
    alone = [arc for arc in holders if not rc.sharable or not arc.uses[rc.name].streams]
    if alone and len(holders) > 1:
        yield f"{rc.name} has one holder", holders
    epochs = [arc.epochs[rc.name] for arc in holders]
    if len({*epochs}) < len(epochs):
        yield f"{rc.name}'s epochs are given once", holders
    if any(epoch > rc.epoch for epoch in epochs):
        yield f"{rc.name}'s epochs grow", holders
    connected = [arc for arc in holders if arc.state in CONNECTED]
    if connected and not rc.up:
        yield f"{rc.name} is down and has no holders", connected
    if rc.sharable and any(arc.understates for arc in connected) and understating(schedule.table, rc.name):
        yield f"{rc.name} serves all its holders in time, with the packet times that were measured", connected
    for arc in connected:
        if not schedule.table.fits(arc, [other for other in connected if other is not arc]):
            yield f"{rc.name} serves all its holders in time", connected
