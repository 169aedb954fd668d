"""What can be said to the nameserver, and what it tells."""

from __future__ import annotations

from typing import Annotated

from backbone.component.messages import ComponentState
from backbone.errors import Refusal
from backbone.ranges import MANY, Instant, Mention
from backbone.wire import Message

ADDRESS = "backbone/nameserver"
RECONNECT_S = 1.0  # chosen: machine seconds, twice the 0.5 s in which components find a restarted hub


class Register(Message, frozen=True):
    """I begin to live under this name. Asked by the component shell before its readiness.

    Attributes:
        component: Who it is; its state is CONNECTING.
    """

    component: ComponentState


class Registered(Message, frozen=True):
    """Answer to ``Register``: the name is yours until your liveliness token falls."""


class Resolve(Message, frozen=True):
    """Where is the component of this name?"""

    name: Mention


class Resolved(Message, frozen=True):
    """Answer to ``Resolve``."""

    component: ComponentState


class ListComponents(Message, frozen=True):
    """Who is there? Empty fields match all."""

    subsystem: Mention = ""
    type: Mention = ""


class Components(Message, frozen=True):
    """Answer to ``ListComponents``, sorted by address.

    Attributes:
        components: Who is registered now.
        complete: False for the moment after the hub's own restart in which components still reconnect
            (``RECONNECT_S``): absence proves nothing then.
        hub_since_s: Mission time at which the hub began to listen.
        unknown: Addresses that are alive and did not say yet who they are, sorted; they are not in the list.
    """

    components: Annotated[list[ComponentState], MANY]
    complete: bool
    hub_since_s: Instant
    unknown: Annotated[list[Mention], MANY] = []


class Appeared(Message, frozen=True):
    """Published when a component is ready."""

    component: ComponentState


class Disappeared(Message, frozen=True):
    """Published when a component's liveliness token has fallen."""

    address: Mention


class NameTaken(Refusal):
    """A living component has this name."""

    code = "nameserver.taken"
    remedy = "It runs already: see 'scout-backbone status'. Stop it first, or give the new one a name of its own."


class UnknownName(Refusal):
    """Nobody of this name is registered."""

    code = "nameserver.unknown"
    remedy = "See 'scout-backbone status' for the names that are there."


NameserverQuestion = Register | Resolve | ListComponents
