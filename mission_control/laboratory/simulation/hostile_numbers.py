"""Hostile messages: impossible numbers under the address of a component that may send such a message.

They are encoded and decoded as between processes, so a message that the decoder rejects reaches no component.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass
from random import Random

from backbone.addresses import RC_MANAGER
from backbone.bus.interface import Bus, Clock
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.rc_manager.messages import (
    ChangeRuntime,
    Connect,
    Disconnect,
    Extend,
    Leases,
    OpenGate,
    RcState,
    SetPriority,
)
from backbone.scheduling.requests import PathNode, RcUse, SchedulingRequest, Usage
from backbone.wire import Envelope, Message, Reader, write
from mission_control.laboratory.simulation.audit import Audit
from mission_control.laboratory.simulation.supervised_shape import SupervisedShape

WITHIN_S = 1.0  # chosen: every component answers a refusal at once
COUNTS = (2**63 - 1, 2**63, 2**64 - 1, -(2**63))
TIMES = (1e9, 1e308, math.inf, -math.inf, math.nan, -1.0)


@dataclass(frozen=True, slots=True)
class HostileMessage:
    """A hostile message.

    Attributes:
        source: Address of its alleged sender.
        target: Address of its receiver; for a publication, the address under which it is published.
        conversation: Conversation of a publication; empty: a question.
    """

    source: str
    target: str
    conversation: str
    body: Message


def hostile_message(shape: SupervisedShape, target: str, number: int) -> HostileMessage:
    """Return the hostile message of this number for this component."""
    dice = Random(f"hostile {number}")
    count, time_s = dice.choice(COUNTS), dice.choice(TIMES)
    _, _, rcs, arcs, owners, _ = shape.groups()
    rc, arc, owner = dice.choice(rcs), dice.choice(arcs), dice.choice(owners)
    pool = Subsystem.RESOURCE_POOL
    if target == RC_MANAGER.partition("/")[2]:
        state = RcState(rc, "scout", False, time_s, [], count, 0, 0)
        usage = Usage(time_s, time_s)
        request = SchedulingRequest(
            arc, owner, [PathNode(owner, count)], False, [{rc: RcUse([usage])}], time_s, dice.choice(TIMES)
        )
        source = address(pool, arc)
        makers: list[Callable[[], HostileMessage]] = [
            lambda: HostileMessage(address(pool, rc), address(pool, rc), Conversation.TELEMETRY, state),
            lambda: HostileMessage(source, RC_MANAGER, "", request),
            lambda: HostileMessage(source, RC_MANAGER, "", ChangeRuntime(arc, time_s, dice.choice(TIMES))),
            lambda: HostileMessage(source, RC_MANAGER, "", Extend(arc, time_s)),
            lambda: HostileMessage("ui_console/stranger", RC_MANAGER, "", SetPriority(owner, count)),
        ]
        return dice.choice(makers)()
    at = address(pool, target)
    if target in rcs:
        bodies: list[Message] = [
            Disconnect(arc, count, "hostile"),
            Connect(arc, count, time_s, RcUse(), {rc: count}),
            Leases([], time_s),
        ]
    else:
        bodies = [OpenGate({rc: count}, time_s, dice.choice(TIMES))]
    body = dice.choice(bodies)
    if isinstance(body, Leases):
        return HostileMessage(RC_MANAGER, RC_MANAGER, Conversation.LEASES, body)
    return HostileMessage(RC_MANAGER, at, "", body)


async def say_hostile(message: HostileMessage, join: Callable[[str, Clock], Bus], clock: Clock, audit: Audit) -> None:
    """Send the message; record whether the decoder accepted it, and the answer."""
    body = message.body
    try:
        raw = write(Envelope(1, message.source, 1, clock.now_s(), "", body))
        body = Reader(type(body)).read(raw).body
    except Refusal as refusal:
        audit.note("mission", "hostile refused", message=type(body).__name__, how=type(refusal).__name__)
        return
    audit.note("mission", "hostile passed", message=type(body).__name__)
    bus = join(message.source, clock)
    try:
        if message.conversation:
            bus.publish(message.target, Conversation(message.conversation), body)
            await asyncio.sleep(0)
        else:
            await bus.ask(message.target, body, Message, within_s=WITHIN_S)
    except (Refusal, LinkError) as error:
        audit.note("mission", "hostile answered", how=type(error).__name__)
    finally:
        await bus.close()
