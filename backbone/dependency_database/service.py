"""The static dependency database: lists hardware and finds sets of it for ARCs."""

from __future__ import annotations

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.dependency_database.inventory import Inventory
from backbone.dependency_database.messages import (
    AskResources,
    DependencyDatabaseQuestion,
    FindRcs,
    NoSuchHardware,
    RcSets,
    Resource,
    Resources,
)
from backbone.spoken import counted
from backbone.wire import Envelope, Message


class DependencyDatabaseParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The hardware of the mission file.

    Attributes:
        resources: In the form of ``msgspec.to_builtins``, in the order of the mission file.
    """

    resources: list[Resource] = []


class DependencyDatabase(Component[DependencyDatabaseParameters]):
    """Answers from its parameters alone, so a restart loses nothing."""

    parameters_type = DependencyDatabaseParameters
    accepts = DependencyDatabaseQuestion

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._inventory = Inventory(self.parameters.resources)
        self._found = self._refused = 0

    def parameters_changed(self) -> None:
        """Use the new list of hardware from now on."""
        self._inventory = Inventory(self.parameters.resources)

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer ``AskResources`` and ``FindRcs``."""
        match asked.body:
            case AskResources():
                return Resources(self._inventory.resources)
            case FindRcs() as wanted:
                sets = self._find(wanted, asked.source)
                return RcSets(sets, sorted(self._inventory.sharable(sets)))
        return await super().answer(asked)

    def statistics(self) -> dict[str, float]:
        """Return counts of resources and of searches."""
        return {
            "resources": float(len(self.parameters.resources)),
            "searches_found": float(self._found),
            "searches_refused": float(self._refused),
        }

    def _find(self, wanted: FindRcs, asker: str) -> list[dict[str, str]]:
        try:
            sets = self._inventory.find(wanted)
        except NoSuchHardware as refusal:
            self._refused += 1
            self.story.note(asker, f"found no hardware: {refusal.detail}")
            raise
        self._found += 1
        self.story.note(asker, f"found {counted(len(sets), 'set')} of {', '.join(wanted.roles)}")
        return sets
