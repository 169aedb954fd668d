"""Messages to the nameserver, and its publications."""

from __future__ import annotations

from typing import Annotated

from backbone.component.messages import ComponentState, Register
from backbone.errors import Refusal
from backbone.ranges import MANY, Instant, Mention
from backbone.wire import Message

RECONNECT_S = 1.0  # chosen: machine seconds, twice the 0.5 s in which components find a restarted hub


class Resolve(Message, frozen=True):
    """Ask for the component of this name."""

    name: Mention


class Resolved(Message, frozen=True):
    """Answer to ``Resolve``."""

    component: ComponentState


class ListComponents(Message, frozen=True):
    """Ask for the registered components. Empty fields match all."""

    subsystem: Mention = ""
    type: Mention = ""


class Components(Message, frozen=True):
    """Answer to ``ListComponents``, sorted by address.

    Attributes:
        complete: False for ``RECONNECT_S`` after a restart of the hub, while components still reconnect: a missing
            component may then be alive.
        hub_since_s: Mission time at which the hub began to listen.
        unknown: Sorted addresses of living components that have not introduced themselves yet; not in the list.
    """

    components: Annotated[list[ComponentState], MANY]
    complete: bool
    hub_since_s: Instant
    unknown: Annotated[list[Mention], MANY] = []


class Appeared(Message, frozen=True):
    """Published when a component is ready."""

    component: ComponentState


class Disappeared(Message, frozen=True):
    """Published when a component's liveliness token has ended."""

    address: Mention


class UnknownName(Refusal):
    """No component of this name is registered."""

    code = "nameserver.unknown"
    remedy = "See 'scout-backbone status' for the names of all components."


NameserverQuestion = Register | Resolve | ListComponents
