"""Live hardware: RCs that people started in a running mission, and that the mission file does not have.

This file stores nothing, because the placer knows which RCs are wanted, and each RC knows its parameters. So a
dependency database finds them again after a restart, and after a lost message.

Rules of this file:

* An RC counts once it is ready, if the placer has placed it under its name and type. A component that the placer did
  not start is a stranger, and does not count.
* An RC counts until the placer no longer has it. If it ended without an order, it still counts, because it comes back.
* Only a mission file states settling time, release time and features. An RC gets those of the first resource of its
  type in the mission file.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection, Sequence
from typing import Annotated

import msgspec

from backbone.addresses import NAMESERVER, PLACER
from backbone.bus.interface import Bus
from backbone.component.messages import AskParameters, ComponentState, LifeState, Parameters
from backbone.dependency_database.messages import Resource
from backbone.errors import LinkError, Refusal
from backbone.incarnation import Incarnation
from backbone.nameserver.messages import Components, ListComponents
from backbone.naming import Subsystem, component_of
from backbone.placer.messages import AskPlacement, NotPlaced, Placement
from backbone.ranges import FEW, MANY, Mention, Share

REPLY_TIME_S = 0.5  # chosen: a hundred round trips; a component that needs longer is asked again later


class _Sharing(msgspec.Struct, frozen=True):
    """Parameters that every RC has; further ones are ignored."""

    driver: Mention = "simulated"
    sharable: bool = False
    capacity: Share = 1.0
    links: Annotated[dict[Mention, Annotated[list[Mention], MANY]], FEW] = {}


class LiveHardware:
    """The RCs of a running mission that are not in its file.

    Attributes:
        resources: Name → resource, in the order in which they were added.
        is_sure: False if a component did not answer at the last comparison, so it must be repeated soon.
    """

    def __init__(self, bus: Bus, note: Callable[[str, str], object]) -> None:
        """Begin without RCs.

        Args:
            note: Subject, event → the mission's log.
        """
        self.resources: dict[str, Resource] = {}
        self.is_sure = False
        self._bus, self._note = bus, note
        self._strangers: dict[str, str] = {}  # name → why it does not count
        self._lives: dict[str, Incarnation] = {}
        self._alone = asyncio.Lock()

    async def compare(self, declared: Sequence[Resource], kinds: Collection[str]) -> bool:
        """Add new RCs, and remove RCs that are no longer wanted; return whether the resources changed.

        Args:
            declared: The resources of the mission file.
            kinds: The types of RCs.
        """
        async with self._alone:
            before = dict(self.resources)
            self.is_sure = True
            names = {resource.name for resource in declared}
            try:
                listed = await self._bus.ask(
                    NAMESERVER, ListComponents(Subsystem.RESOURCE_POOL), Components, within_s=REPLY_TIME_S
                )
            except LinkError:
                self.is_sure = False
                return False
            self.is_sure = listed.complete
            there = {
                component_of(one.address): one
                for one in listed.components
                if one.type in kinds and one.state is LifeState.READY and component_of(one.address) not in names
            }
            for name in before.keys() - there.keys():
                await self._let_go_unless_wanted(name)
            for component in there.values():
                await self._take_in(component, next((one for one in declared if one.type == component.type), None))
            return self.resources != before

    async def _take_in(self, component: ComponentState, like: Resource | None) -> None:
        name, life = component_of(component.address), component.incarnation
        if self._lives.get(name) == life:
            return
        try:
            placement = await self._bus.ask(PLACER, AskPlacement(name), Placement, within_s=REPLY_TIME_S)
            said = await self._bus.ask(component.address, AskParameters(), Parameters, within_s=REPLY_TIME_S)
            resource = resource_like(like, name, placement.type, placement.host, said.values)
        except NotPlaced as stranger:
            self._refuse(name, stranger.detail)
        except msgspec.ValidationError as wrong:
            self._refuse(name, f"its parameters are not those of an RC: {wrong}")
        except (LinkError, Refusal):
            self.is_sure = False
        else:
            if resource.type != component.type:
                self._refuse(name, f"the placer has it as a {resource.type}, but it is a {component.type}")
                return
            if self.resources.get(name) != resource:
                self._note(name, f"can be claimed: a {resource.type} on {resource.host}, started by hand")
            self.resources[name], self._lives[name] = resource, life
            self._strangers.pop(name, None)

    async def _let_go_unless_wanted(self, name: str) -> None:
        try:
            await self._bus.ask(PLACER, AskPlacement(name), Placement, within_s=REPLY_TIME_S)
        except NotPlaced:
            del self.resources[name], self._lives[name]
            self._note(name, "can no longer be claimed: it was stopped, and the mission file does not have it")
        except LinkError:
            self.is_sure = False

    def _refuse(self, name: str, why: str) -> None:
        if self._strangers.get(name) != why:
            self._strangers[name] = why
            self._note(name, f"cannot be claimed: {why}")


def resource_like(like: Resource | None, name: str, kind: str, host: str, parameters: dict[str, object]) -> Resource:
    """Return the resource of an RC with these parameters.

    Args:
        like: A resource of its type in the mission file; None: the file has none.
        host: Host on which it runs, to which its hardware is wired.

    Raises:
        msgspec.ValidationError: The parameters are not those of an RC.

    Example:
        >>> radio = Resource("radio1", "command_radio", sharable=True, connect_s=0.2)
        >>> added = resource_like(radio, "radio2", "command_radio", "field", {"sharable": True, "capacity": 0.5})
        >>> added.host, added.sharable, added.capacity, added.connect_s
        ('field', True, 0.5, 0.2)
    """
    sharing = msgspec.convert(parameters, _Sharing)
    return msgspec.structs.replace(
        like if like is not None else Resource("", kind),
        name=name,
        type=kind,
        host=host,
        process="",
        parameters={key: value for key, value in parameters.items() if key not in _Sharing.__struct_fields__},
        **msgspec.structs.asdict(sharing),
    )
