"""Packet lines: declared and measured packet times of ARCs, and ARCs that sharable RCs can never serve, in words."""

from __future__ import annotations

from collections.abc import Iterator

from backbone.scheduling.entries import ArcEntry
from backbone.scheduling.state import ScheduleState


def packet_lines(arc: ArcEntry) -> list[str]:
    """Return a line for each stream of the ARC whose packets take longer than it declared."""
    return [*_lines(arc)]


def never_served(arc: ArcEntry, state: ScheduleState) -> tuple[str, str]:
    """Return why the ARC fits on no RC of its set even alone, and what would let it run."""
    crowded = ", ".join(rc for rc in arc.uses if state.rcs[rc].sharable)
    until = f"the capacity of {crowded} grows"
    if packet_lines(arc):  # measured times are forgotten when the ARC ends
        until = f"its owner claims anew, with a longer period or once {crowded} is faster"
    return f"{crowded} could not serve it even alone", until


def _lines(arc: ArcEntry) -> Iterator[str]:
    declared = arc.request.uses_of(arc.uses)
    counts = "the longer time counts as soon as its slice ends, or another needs the room"
    for rc in arc.shares:
        for number, usage in enumerate(declared[rc].streams):
            takes_s = arc.measured[rc][number].packet_us / 1e6
            if takes_s > usage.packet_time_s:
                what = f"its {usage.kind} packets" if usage.kind else "its packets"
                times = f"on {rc} take {takes_s * 1e3:g} ms, it declared {usage.packet_time_s * 1e3:g}"
                yield f"{what} {times}: {counts if arc.understates else 'the longer time counts'}"
