"""Attributes of a mission that is up: priorities, places in the behavior tree, run times, parameters.

The owner of a value changes it: the RC manager changes priority and place; the ARC changes run times and puts them into
its requests; the component changes its parameters.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from backbone.addresses import LAUNCHER, NAMESERVER, RC_MANAGER
from backbone.bus.interface import Bus
from backbone.command_line.connection import REPLY_TIME_S
from backbone.component.messages import AskParameters, Parameters, SetParameter
from backbone.errors import LinkError, Refusal
from backbone.launcher.messages import AskTree, Tree
from backbone.mission.document import outline
from backbone.nameserver.messages import Resolve, Resolved, UnknownName
from backbone.naming import component_of
from backbone.rc_manager.messages import AskAttributes, Done, MoveNode, SetPriority
from backbone.scheduling.requests import PathNode, RcUse, UnknownRequest, Usage
from backbone.scheduling.views import Attributes, RequestAttributes
from backbone.spoken import value_text
from backbone.wire import plain

PRIORITY, PARENT = "priority", "parent"
RUN_TIMES = ("minimum_runtime_s", "maximum_runtime_s")


class WrongAttribute(Refusal):
    """The attribute does not exist, or the value does not fit it; nothing is changed."""

    code = "attribute.wrong"
    remedy = "See 'scout-backbone set NAME' for its attributes; a priority is a whole number, a parent a node's name."


@dataclass(frozen=True)
class ShownAttributes:
    """Attributes of one name: requests, parameters, or both.

    Attributes:
        requests: Requests of this ARC, or of all ARCs at and below this node.
        parameters: Parameters of the component of this name; None: no component has it.
    """

    name: str
    requests: Sequence[RequestAttributes]
    parameters: Mapping[str, object] | None

    def lines(self) -> list[str]:
        """Return all attributes as lines for people."""
        lines = [line for request in self.requests for line in _request_lines(request)]
        if self.parameters is not None:
            lines.append(f"{self.name}: parameters")
            lines += [f"  {name:<19}{value_text(value)}" for name, value in self.parameters.items()]
            if not self.parameters:
                lines.append("  none")
        return lines

    def of(self, attribute: str) -> list[str]:
        """Return one attribute of the component, or of each request, as lines for people.

        The request of a component comes before its parameter, because an operator may have changed the request.

        Raises:
            WrongAttribute: No attribute has this name.
        """
        is_parameter = self.parameters is not None and attribute in self.parameters
        lines = [
            f"{request.arc}: {attribute} is {value}"
            for request in self.requests
            if not is_parameter or component_of(request.owner) == self.name
            for value in _values(request, attribute)
        ]
        if not lines and self.parameters is not None and is_parameter:
            return [f"{self.name}: {attribute} is {value_text(self.parameters[attribute])}"]
        if not lines:
            raise WrongAttribute(f"{self.name} has no {attribute}", name=self.name)
        return lines

    def to_json(self) -> dict[str, object]:
        """Return all attributes as plain data."""
        return {"name": self.name, "requests": [*map(_plain, self.requests)], "parameters": self.parameters}


async def attributes_of(bus: Bus, name: str) -> ShownAttributes:
    """Return the attributes of a component, an ARC's request, or a node of the behavior tree.

    Raises:
        UnknownName: No component or node has this name; the detail suggests the nearest name.
        LinkError: Nameserver, RC manager or component did not answer.
    """
    values, requests, unknown = None, list[RequestAttributes](), None
    try:
        at = await _address(bus, name)
        values = (await bus.ask(at, AskParameters(), Parameters, within_s=REPLY_TIME_S)).values
    except UnknownName as refusal:
        unknown = refusal
    try:
        requests = (await bus.ask(RC_MANAGER, AskAttributes(name), Attributes, within_s=REPLY_TIME_S)).requests
    except UnknownRequest:
        if unknown is not None:
            raise unknown from None
    return ShownAttributes(name, requests, values)


async def change(bus: Bus, name: str, attribute: str, value: object, user: str) -> list[str]:
    """Change one attribute; the next decision of RC manager, ARC or component uses the new value.

    Args:
        name: Name of a component, an ARC, a console, or a node of the behavior tree.
        attribute: ``priority``, ``parent``, a run time, or a parameter of the component.

    Returns:
        The present values, for people.

    Raises:
        Refusal: The value is impossible; nothing is changed.
        LinkError: A component did not answer; the outcome is unknown.
    """
    if attribute == PRIORITY:
        return await _set_priority(bus, name, value)
    if attribute == PARENT:
        return await _move(bus, name, value)
    shown = await attributes_of(bus, name)
    own = [request.arc for request in shown.requests if component_of(request.owner) == name]
    if attribute in RUN_TIMES and own:
        return [line for arc in own for line in await _set_parameter(bus, arc, attribute, value, user)]
    if shown.parameters is None:
        raise WrongAttribute(f"{name} is no component and claims no ARC: it has no {attribute}", name=name)
    return await _set_parameter(bus, name, attribute, value, user)


async def _set_priority(bus: Bus, name: str, value: object) -> list[str]:
    if isinstance(value, bool) or not isinstance(value, int):
        raise WrongAttribute(f"the priority of {name} cannot be {value!r}", name=name)
    await _require_known(bus, name)
    await bus.ask(RC_MANAGER, SetPriority(name, value), Done, within_s=REPLY_TIME_S)
    try:
        found = await bus.ask(RC_MANAGER, AskAttributes(name), Attributes, within_s=REPLY_TIME_S)
    except UnknownRequest:
        return [f"{name}: nothing at or below it asks for run time yet; when it does, its priority is {value}"]
    return [f"{name}: priority is {value}", *(f"  {one.arc} has {_path(one.path)}" for one in found.requests)]


async def _require_known(bus: Bus, name: str) -> None:
    """Return if an ARC asks for run time at or below this name, or a component or a behavior of the tree has it.

    Raises:
        UnknownName: Nothing has this name; the detail suggests the nearest name.
    """
    try:
        await bus.ask(RC_MANAGER, AskAttributes(name), Attributes, within_s=REPLY_TIME_S)
    except UnknownRequest:
        try:
            await _address(bus, name)
        except UnknownName:
            if name not in await _behaviors(bus):
                raise


async def _behaviors(bus: Bus) -> list[str]:
    """Return the names of all behaviors of the present tree, running or not; none if the launcher does not answer."""
    try:
        tree = await bus.ask(LAUNCHER, AskTree(), Tree, within_s=REPLY_TIME_S)
    except LinkError:
        return []
    return [one.text("name") for one in outline(tree.text.encode()) if one.tag == "behavior"]


async def _move(bus: Bus, name: str, value: object) -> list[str]:
    await bus.ask(RC_MANAGER, MoveNode(name, str(value)), Done, within_s=REPLY_TIME_S)
    found = await bus.ask(RC_MANAGER, AskAttributes(name), Attributes, within_s=REPLY_TIME_S)
    return [f"{name}: parent is {value}", *(f"  {one.arc} has {_path(one.path)}" for one in found.requests)]


async def _set_parameter(bus: Bus, name: str, parameter: str, value: object, user: str) -> list[str]:
    now = await bus.ask(
        await _address(bus, name), SetParameter(parameter, value, user), Parameters, within_s=REPLY_TIME_S
    )
    return [f"{name}: {parameter} is {value_text(now.values[parameter])}"]


async def _address(bus: Bus, name: str) -> str:
    return (await bus.ask(NAMESERVER, Resolve(name), Resolved, within_s=REPLY_TIME_S)).component.address


def _plain(request: RequestAttributes) -> dict[str, object]:
    uses = {rc: plain(use.streams) for rc, use in request.uses.items()}
    return {**plain(request), "uses": uses}


def _request_lines(request: RequestAttributes) -> Iterator[str]:
    yield f"{request.arc}: {request.state}, for {request.owner}"
    for attribute in (PRIORITY, PARENT, *RUN_TIMES):
        for value in _values(request, attribute):
            yield f"  {attribute:<19}{value}"
    for rc, use in request.uses.items():
        yield f"  {rc:<19}{_use(use)}"


def _values(request: RequestAttributes, attribute: str) -> Iterator[str]:
    match attribute:
        case "priority":
            yield f"{request.path[-1].priority} ({_path(request.path)})"
        case "parent" if len(request.path) > 1:
            yield request.path[-2].name
        case "minimum_runtime_s" | "maximum_runtime_s":
            yield f"{getattr(request, attribute):g}"


def _path(path: Sequence[PathNode]) -> str:
    return "/".join(f"{node.name}:{node.priority}" for node in path)


def _use(use: RcUse) -> str:
    return "; ".join(map(_stream, use.streams)) if use.streams else "for itself alone"


def _stream(usage: Usage) -> str:
    share = usage.packet_time_s / usage.period_s
    extra = [
        f"{what} {time_s * 1000:g} ms"
        for what, time_s in (("deadline", usage.deadline_s), ("jitter", usage.jitter_s))
        if time_s > 0
    ]
    every = f"{usage.packet_time_s * 1000:g} ms every {usage.period_s * 1000:g} ms, {share:.1%} of its time"
    return ", ".join([f"{usage.kind}: {every}" if usage.kind else every, *extra])
