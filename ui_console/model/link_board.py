"""Links and machines: the link to the hub, the RC manager's renewals, radios, hosts.

Rules of this file: no bus, no clock, no screen; messages go in, views and alarms come out; times are arguments.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from backbone.creator.messages import HostLoad
from backbone.rc_manager.messages import Leases
from backbone.spoken import counted
from ui_console.model.alarms import AlarmBook
from ui_console.model.events import LinkHeard
from ui_console.model.views import NONE_S, AlarmKind, HostView, LinkView

OVERLOAD_CPU = 0.95  # chosen: above it slices and pictures are late
NO_LINK = "no link to the hub: what is shown is old, and nothing can be stopped from here"


class LinkBoard:
    """State of links and hosts, from messages."""

    def __init__(self, alarms: AlarmBook) -> None:
        self._alarms = alarms
        self.leases: Leases | None = None
        """The leases last renewed."""
        self._leases_s = NONE_S
        self._hosts: dict[str, tuple[float, HostLoad]] = {}
        self._overruns: dict[tuple[str, str], float] = {}
        self._radios: dict[str, Mapping[str, float]] = {}
        self._link = LinkHeard(0.0, True)
        self._link_heard_s = 0.0
        self.back_s = NONE_S
        """Time at which the link last came back; negative: it was never down."""

    def take_link(self, link: LinkHeard) -> None:
        """Record the state of the link, or a measurement of it."""
        if link.is_up:
            if self.down_s(link.at_s) >= 0:
                self.back_s = link.at_s
            self._link_heard_s = link.at_s
            latency_s = link.latency_s if link.latency_s >= 0 else self._link.latency_s
            self._link = dataclasses.replace(link, latency_s=latency_s)
        else:
            self._link = link
        self._alarms.hold(not link.is_up, AlarmKind.LINK, "hub", NO_LINK, link.at_s)

    def take_load(self, load: HostLoad, at_s: float) -> None:
        """Record the load of a host."""
        self._hosts[load.host] = (at_s, load)
        line = f"{load.host} is busy at {load.cpu:.0%} of its {load.cores} cores"
        self._alarms.hold(load.cpu >= OVERLOAD_CPU, AlarmKind.OVERLOAD, load.host, line, at_s)

    def take_counts(self, radio: str, values: Mapping[str, float], at_s: float) -> None:
        """Record the counts of a radio: late packets raise an alarm of their ARC."""
        self._radios[radio] = values
        known = {(radio, name.removeprefix("overruns_")) for name in values}
        self._overruns = {key: count for key, count in self._overruns.items() if key[0] != radio or key in known}
        for name, count in values.items():
            arc = name.removeprefix("overruns_")
            if arc == name:
                continue
            before = self._overruns.get((radio, arc), 0.0)
            self._overruns[radio, arc] = count
            if count > before:
                late = int(count)
                line = f"{counted(late, 'packet')} of {arc} on {radio} {'was' if late == 1 else 'were'} late or lost"
                remedy = "Claim with a longer period, or use another radio."
                self._alarms.happened(AlarmKind.DEADLINE, arc, line, at_s, remedy, f"deadline:{radio}:{arc}")

    def take_leases(self, leases: Leases, at_s: float) -> None:
        """Record the leases the RC manager renewed."""
        self.leases, self._leases_s = leases, at_s

    def look(self, now_s: float) -> None:
        """Check whether the link is silent."""
        self._alarms.hold(self.down_s(now_s) >= 0, AlarmKind.LINK, "hub", NO_LINK, now_s)

    def radio_line(self, arc: str) -> str:
        """Return a line about an ARC's packets on its radio; empty: no radio reported on the ARC."""
        counts = [(radio, int(count)) for (radio, of), count in sorted(self._overruns.items()) if of == arc]
        return ", ".join(
            f"{radio} is missing" if self.is_missing(radio) else f"{radio}: {counted(late, 'packet')} late or lost"
            for radio, late in counts
        )

    def down_s(self, now_s: float) -> float:
        """Return the time from which the mission's hub is silent; negative: the link is up."""
        link = self._link
        return NONE_S if link.is_up and now_s <= link.until_s else self._link_heard_s

    def is_missing(self, rc: str) -> bool:
        """Return whether the RC manager misses this RC."""
        return self.leases is not None and rc in self.leases.missing

    def is_host(self, name: str) -> bool:
        """Return whether this is a machine of the mission."""
        return name in self._hosts

    def hosts(self, now_s: float) -> list[HostView]:
        """Return the machines, sorted by name."""
        return [HostView(load, max(0.0, now_s - at_s)) for _, (at_s, load) in sorted(self._hosts.items())]

    def views(self, now_s: float) -> list[LinkView]:
        """Return the link to the hub, the RC manager's renewals, and the radios."""
        renewed = f"leases renewed {now_s - self._leases_s:.1f} s ago" if self._leases_s >= 0 else ""
        views = [LinkView("hub", self.down_s(now_s) < 0, self._link.latency_s, renewed)]
        for radio, values in sorted(self._radios.items()):
            sent, late = values.get("packets_sent", 0.0), values.get("overruns", 0.0)
            worst_ms = 1e3 * values.get("worst_packet_s", 0.0)
            feedback = f"{sent:.0f} packets sent, {late:.0f} late or lost, slowest {worst_ms:.1f} ms"
            views.append(LinkView(radio, not self.is_missing(radio), NONE_S, feedback))
        return views
