"""The dependency database: lists hardware and finds sets of it for ARCs.

The hardware consists of the resources of the mission file, and of the RCs that people started in the running mission.
"""

from __future__ import annotations

import asyncio

import msgspec

from backbone.addresses import NAMESERVER
from backbone.bus.interface import Bus, Clock
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.dependency_database.inventory import Inventory
from backbone.dependency_database.live_hardware import LiveHardware
from backbone.dependency_database.messages import (
    AskResources,
    DependencyDatabaseQuestion,
    FindRcs,
    HardwareChanged,
    NoSuchHardware,
    RcSets,
    Resource,
    Resources,
)
from backbone.keys import Conversation
from backbone.nameserver.messages import RECONNECT_S, Appeared, Disappeared
from backbone.naming import component_of
from backbone.spoken import counted
from backbone.waiting import set_within
from backbone.wire import Envelope, Message

COMPARE_EVERY_S = 20.0  # chosen: every known change is compared at once; this finds unknown changes


class DependencyDatabaseParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The hardware of the mission file.

    Attributes:
        resources: The resources, in the form of ``msgspec.to_builtins``, in the order of the mission file.
        kinds: Types of RCs that an ARC type needs, also those without a resource.
    """

    resources: list[Resource] = []
    kinds: list[str] = []


class DependencyDatabase(Component[DependencyDatabaseParameters]):
    """Answers from its parameters and from the answers of placer and RCs, so a restart loses nothing."""

    parameters_type = DependencyDatabaseParameters
    accepts = DependencyDatabaseQuestion

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._inventory = Inventory(self.parameters.resources)
        self._found = self._refused = 0
        self._by_hand = LiveHardware(bus, self.publish_event)
        self._to_compare = asyncio.Event()

    async def connect(self) -> None:
        """Find the RCs that were started in the running mission, before the RC manager asks for the hardware."""
        self.bus.subscribe(NAMESERVER, Conversation.EVENTS, Appeared | Disappeared, self._component_changed)
        self.bus.watch_link(lambda up: self._to_compare.set() if up else None)
        await self._compare()

    async def serve(self) -> None:
        """Compare again at every change of a component that may be an RC, and every ``COMPARE_EVERY_S``."""
        while True:
            await set_within(self._to_compare, COMPARE_EVERY_S if self._by_hand.is_sure else RECONNECT_S)
            self._to_compare.clear()
            await self._compare()

    def parameters_changed(self) -> None:
        """Use the new list of hardware from now on."""
        self._hardware_changed()
        self._to_compare.set()

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer ``AskResources`` and ``FindRcs``."""
        match asked.body:
            case AskResources():
                return Resources(self._inventory.resources)
            case FindRcs() as wanted:
                sets = await self._find(wanted, asked.source)
                return RcSets(sets, sorted(self._inventory.sharable(sets)))
        return await super().answer(asked)

    def statistics(self) -> dict[str, float]:
        """Return counts of resources and of searches."""
        return {
            "resources": float(len(self._inventory.resources)),
            "searches_found": float(self._found),
            "searches_refused": float(self._refused),
        }

    async def _find(self, wanted: FindRcs, asker: str) -> list[dict[str, str]]:
        try:
            sets = await self._find_also_new(wanted)
        except NoSuchHardware as refusal:
            self._refused += 1
            self.story.note(asker, f"found no hardware: {refusal.detail}")
            raise
        self._found += 1
        self.story.note(asker, f"found {counted(len(sets), 'set')} of {', '.join(wanted.roles)}")
        return sets

    async def _find_also_new(self, wanted: FindRcs) -> list[dict[str, str]]:
        """Return the sets that match; an RC that became ready a moment ago counts."""
        try:
            return self._inventory.find(wanted)
        except NoSuchHardware:
            await self._compare()
        return self._inventory.find(wanted)

    @property
    def _kinds(self) -> set[str]:
        return {*self.parameters.kinds, *(resource.type for resource in self.parameters.resources)}

    async def _compare(self) -> None:
        if await self._by_hand.compare(self.parameters.resources, self._kinds):
            self._hardware_changed()

    def _hardware_changed(self) -> None:
        declared = self.parameters.resources
        names = {resource.name for resource in declared}
        added = [resource for name, resource in self._by_hand.resources.items() if name not in names]
        self._inventory = Inventory([*declared, *added])
        self.bus.publish(self.address, Conversation.EVENTS, HardwareChanged())

    def _component_changed(self, heard: Envelope[Message]) -> None:
        match heard.body:
            case Appeared(component=component):
                declared = {resource.name for resource in self.parameters.resources}
                concerns = component.type in self._kinds and component_of(component.address) not in declared
            case Disappeared(address=address):
                concerns = component_of(address) in self._by_hand.resources
            case _:
                return
        if concerns:
            self._to_compare.set()
