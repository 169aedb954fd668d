"""The liveness law: soon after the last fault, each wanted component runs again or is reported as absent.

* said: the launcher never publishes health ``ok`` for more than ``SAID_WITHIN_S`` while the same component is missing.
Its last publication counts until it has published nothing for ``SILENT_AFTER_S``.
* liveness: ``RUNS_AGAIN_S`` after the last fault each wanted component runs, and the RC manager knows the request of
  each ARC among them, or a component's ``absent`` names it.
* no-false-alarm: if all wanted components run at that time, health is ``ok``.
* lives: only paused processes are ended as hung, because a starved process is late, not dead.

``Watcher`` records; ``first_unhealed`` judges the records and is pure.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from backbone.addresses import LAUNCHER
from backbone.bus.interface import Bus, Clock
from backbone.component.messages import Absence, LifeState
from backbone.creator.messages import creator_name
from backbone.keys import Conversation
from backbone.picture.health import SILENT_AFTER_S, HealthWord, MissionHealth
from backbone.wire import Envelope
from mission_control.laboratory.simulation.audit import Audit, Happening
from mission_control.laboratory.simulation.audited_pool import AuditedRcManager
from mission_control.laboratory.simulation.laws import Broken
from mission_control.laboratory.simulation.simulated_machines import Machines
from mission_control.laboratory.simulation.supervised_shape import CORE, SupervisedShape, arc_of

RUNS_AGAIN_S = 40.0
"""Chosen: hung for 3 s, ended within 2 s, restarted after at most 2 s, while its owner compares every 20 s and then
tries every 5 s; a second time for components that depend on it."""
SAID_WITHIN_S = 2.0  # the guaranteed time
LOOK_EVERY_S = 0.25  # chosen: an eighth of that time


class Watcher:
    """Compares wanted components with running ones, and with the published health, until cancelled."""

    def __init__(self, shape: SupervisedShape, machines: Machines, audit: Audit, clock: Clock) -> None:
        self._machines, self._audit, self._clock = machines, audit, clock
        self._core = ["nameserver", *(name for name in CORE if name != "creator"), *map(creator_name, shape.hosts)]
        self._wanted = [
            *self._core,
            *(resource.name for resource in shape.pool.resources),
            *(owner.name for owner in shape.pool.owners),
            *(node.name for node in shape.nodes),
        ]
        self._arcs = [arc_of(node) for node in shape.nodes if node.arc is not None]
        self._calm_arcs = [*self._arcs, *(owner.arc for owner in shape.pool.owners if not owner.rests)]
        self._missing_since_s: dict[str, float] = {}
        self._absent: list[Absence] = []
        self._word, self._heard_s, self._ok_since_s = HealthWord.DEGRADED, clock.now_s(), math.inf

    async def watch(self, bus: Bus) -> None:
        """Compare repeatedly, until cancelled."""
        bus.subscribe(LAUNCHER, Conversation.HEALTH, MissionHealth, self._heard)
        while True:
            now_s = self._clock.now_s()
            missing = self.missing([*self._wanted, *self._arcs])
            self._missing_since_s = {name: self._missing_since_s.get(name, now_s) for name in missing}
            within_s = SAID_WITHIN_S + self._machines.lateness_s()
            says_ok = self._word is HealthWord.OK and now_s - self._heard_s <= SILENT_AFTER_S
            self._ok_since_s = min(self._ok_since_s, now_s) if says_ok else math.inf
            late = [
                name
                for name, since_s in self._missing_since_s.items()
                if now_s - max(since_s, self._ok_since_s) > within_s
            ]
            if late:
                self._audit.note("health", "says ok", missing=late, since_s=self._missing_since_s[late[0]])
            await self._clock.sleep_s(LOOK_EVERY_S)

    def missing(self, wanted: Sequence[str]) -> dict[str, str]:
        """Return the components that do not run or cannot be reached, with the reasons."""
        found = {name: self._why_missing(name) for name in wanted}
        return {name: why for name, why in found.items() if why}

    def judge_calm(self) -> None:
        """Record the missing components at the end of the calm, with their reports."""
        missing = self.missing([*self._wanted, *self._calm_arcs])
        manager = self._machines.component("rc_manager")
        if isinstance(manager, AuditedRcManager):
            known = {request.arc for request in manager.answers.schedule(self._clock.now_s()).requests}
            missing |= {
                arc: "the RC manager does not know it" for arc in self._calm_arcs if arc not in known | missing.keys()
            }
        named = {absence.name: absence.cause for absence in self._absent}
        self._audit.note("health", "at the end", missing=missing, named=named, word=str(self._word))

    def _why_missing(self, name: str) -> str:
        component, process = self._machines.component(name), self._machines.find(name)
        if component is None or process is None:
            return "does not run"
        if component.state is not LifeState.READY:
            return f"is {component.state}"
        if process.is_paused:
            return "is paused"
        return "" if self._machines.network.links[process].is_up else "has no link"

    def _heard(self, heard: Envelope[MissionHealth]) -> None:
        said = heard.body
        if said.word is not self._word:
            self._audit.note("health", str(said.word), absent={absence.name: absence.cause for absence in said.absent})
        self._word, self._absent, self._heard_s = said.word, list(said.absent), self._clock.now_s()


def first_unhealed(happenings: Sequence[Happening]) -> Broken | None:
    """Return the first violation of the liveness law, or None if the law holds."""
    struck: set[str] = set()
    for h in happenings:
        match h.what:
            case "says ok":
                names = h.values["missing"]
                since_s = h.values["since_s"]
                what = f"{', '.join(names)} missing since {since_s:.4f} s, and health says ok"
                return Broken("said", h.at_s, what, tuple(names))
            case "paused":
                struck.add(h.who)
            case "fell" if h.values["how"].startswith("hung") and h.who not in struck:
                return Broken("lives", h.at_s, f"{h.who} was never paused and is ended: {h.values['how']}", (h.who,))
            case "at the end":
                return _at_the_end(h)
            case _:
                pass
    return None


def _at_the_end(h: Happening) -> Broken | None:
    missing, named = h.values["missing"], h.values["named"]
    for name, why in missing.items():
        if name not in named:
            return Broken("liveness", h.at_s, f"{name} is wanted and {why}; no component reports it as absent", (name,))
    if not missing and h.values["word"] != HealthWord.OK:
        reported = "; ".join(f"{name}: {cause}" for name, cause in named.items())
        return Broken("no-false-alarm", h.at_s, f"all that is wanted runs, and health says {reported}", tuple(named))
    return None
