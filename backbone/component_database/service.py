"""The component database: lists component types and admits new components."""

from __future__ import annotations

import msgspec

from backbone.addresses import NAMESERVER
from backbone.bus.interface import Bus, Clock
from backbone.component.asking import ask_until_answered
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component_database.catalogue import Catalogue
from backbone.component_database.messages import (
    Admit,
    Admitted,
    ComponentDatabaseQuestion,
    ComponentType,
    ListTypes,
    RunningUnknown,
    Types,
)
from backbone.errors import LinkError, Refusal
from backbone.nameserver.messages import RECONNECT_S, Components, ListComponents
from backbone.wire import Envelope, Message

LIST_EACH_S, LIST_WITHIN_S = 1.0, 3.0  # chosen: a killed nameserver is back within one second


class ComponentDatabaseParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The component types of the mission file.

    Attributes:
        types: The types, in the form of ``msgspec.to_builtins``.
    """

    types: list[ComponentType] = []


class ComponentDatabase(Component[ComponentDatabaseParameters]):
    """Gets types from its parameters and running components from the nameserver, so a restart loses nothing."""

    parameters_type = ComponentDatabaseParameters
    accepts = ComponentDatabaseQuestion

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._catalogue = Catalogue(self.parameters.types)
        self._admitted = self._refused = 0

    def parameters_changed(self) -> None:
        """Use the new types from now on."""
        self._catalogue = Catalogue(self.parameters.types)

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer ``Admit`` and ``ListTypes``."""
        match asked.body:
            case Admit(type=type_name, name=name):
                return Admitted(await self._admit(type_name, name))
            case ListTypes():
                return Types(self._catalogue.counts((await self._list()).components))
        return await super().answer(asked)

    def statistics(self) -> dict[str, float]:
        """Return counts of types and of admissions."""
        return {
            "types": float(len(self.parameters.types)),
            "admitted": float(self._admitted),
            "refused": float(self._refused),
        }

    async def _admit(self, type_name: str, name: str) -> ComponentType:
        try:
            running = (
                await self._who_runs() if self._catalogue.depends_on_what_runs(type_name) else Components([], True, 0)
            )
            admitted = self._catalogue.admit(type_name, name, running.components)
        except Refusal as refusal:
            self._refused += 1
            self.story.note(name or type_name, f"was not admitted: {refusal.detail}")
            raise
        self._admitted += 1
        self.story.note(name or type_name, f"was admitted as {type_name}")
        return admitted

    async def _who_runs(self) -> Components:
        """Return the registered components; after a hub's restart wait until all had time to reconnect."""
        while True:
            listed = await self._list()
            if listed.complete:
                return listed
            back_s = listed.hub_since_s + RECONNECT_S * self.clock.rate
            await self.clock.sleep_s(max(back_s - self.clock.now_s(), RECONNECT_S / 10 * self.clock.rate))

    async def _list(self) -> Components:
        """Return the registered components.

        Raises:
            RunningUnknown: The nameserver does not answer.
        """
        try:
            return await ask_until_answered(
                self.bus,
                self.clock,
                NAMESERVER,
                ListComponents(),
                Components,
                each_s=LIST_EACH_S,
                within_s=LIST_WITHIN_S,
            )
        except LinkError as error:
            raise RunningUnknown(f"the nameserver does not list the running components: {error}") from error
