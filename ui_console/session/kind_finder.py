"""Kind finder: asks the mission for its kinds of ARC, when an operator claims a robot without naming a kind."""

from __future__ import annotations

import asyncio
from typing import TypeVar

from backbone.addresses import COMPONENT_DATABASE, DEPENDENCY_DATABASE
from backbone.bus.interface import Bus, Clock
from backbone.component.asking import ask_until_answered
from backbone.component_database.messages import ListTypes, Types
from backbone.dependency_database.messages import AskResources, Resources
from backbone.errors import LinkError
from backbone.wire import Message
from ui_console.model.arc_kinds import NoArcKind, Sight, arc_kind

Reply = TypeVar("Reply", bound=Message)
ASK_AGAIN = "Take the robot again in a moment; 'scout-backbone status' names what is absent."
EACH_S, WITHIN_S = 1.0, 5.0  # chosen: a restarted core service is back within a second or two; mission seconds


async def find_arc_kind(bus: Bus, clock: Clock, robot: str, sight: Sight) -> str:
    """Return the kind of ARC for this robot; see ``arc_kind``.

    Raises:
        NoArcKind: The mission has no kind for the robot, or a database did not answer within ``WITHIN_S``.
    """

    async def ask(of: str, question: Message, reply: type[Reply]) -> Reply:
        return await ask_until_answered(bus, clock, of, question, reply, each_s=EACH_S, within_s=WITHIN_S)

    try:
        types, hardware = await asyncio.gather(
            ask(COMPONENT_DATABASE, ListTypes(), Types), ask(DEPENDENCY_DATABASE, AskResources(), Resources)
        )
    except LinkError as error:
        raise NoArcKind(f"the kinds of ARC are not known: {error}", remedy=ASK_AGAIN) from error
    return arc_kind(robot, sight, [one.component_type for one in types.types], hardware.resources)
