"""What can be said to the static dependency database: which hardware exists, and what an ARC needs of it."""

from __future__ import annotations

from typing import Annotated, Any

from backbone.errors import Refusal
from backbone.ranges import FEW, MANY, Duration, Mention, Share, Values
from backbone.wire import Message

ADDRESS = "backbone/dependency_database"


class Resource(Message, frozen=True):
    """One physical resource, and how to run its RC.

    Attributes:
        name: Name of the resource and of its RC.
        type: Component type of its RC (``scout``, ``command_radio``, ``video_frequency``, ``framegrabber`` …).
        host: Host its hardware is wired to; empty: any.
        sharable: True if several ARCs may hold it within its capacity.
        capacity: Share of its time it can give, 0 to 1; 1 for unit resources.
        connect_s: Settling time after a connection, seconds.
        disconnect_s: Release time, seconds.
        driver: Name of the driver its RC uses.
        parameters: Further values for the RC's parameters.
        features: What it has, for wishes (``camera``).
        links: Names of other resources it can only be used with, by kind
            (a framegrabber's ``video_frequency``, a scout's ``command_radio``).
        process: Name of the process its RC shares with others; empty: a process of its own.
    """

    name: Mention
    type: Mention
    host: Mention = ""
    sharable: bool = False
    capacity: Share = 1.0
    connect_s: Duration = 0.0
    disconnect_s: Duration = 0.0
    driver: Mention = "simulated"
    parameters: Values = {}
    features: Annotated[list[Mention], FEW] = []
    links: Annotated[dict[Mention, Annotated[list[Mention], MANY]], FEW] = {}
    process: Mention = ""

    def rc_parameters(self) -> dict[str, Any]:
        """Return the parameters its RC is launched with: driver, sharing and links, then its own."""
        common = {"driver": self.driver, "sharable": self.sharable, "capacity": self.capacity, "links": self.links}
        return {**common, **self.parameters}


class AskResources(Message, frozen=True):
    """Which hardware exists?"""


class Resources(Message, frozen=True):
    """Answer to ``AskResources``, sorted by name."""

    resources: Annotated[list[Resource], MANY]


class FindRcs(Message, frozen=True):
    """Which sets of RCs would do?

    Attributes:
        roles: Kinds of RC the ARC needs, one of each: ``["scout", "command_radio", "video_frequency"]``.
        wish: Kind → name wanted of that kind. Kinds left out: any.
        features: Kind → features wanted of that kind.
    """

    roles: Annotated[list[Mention], FEW]
    wish: Annotated[dict[Mention, Mention], MANY] = {}
    features: Annotated[dict[Mention, Annotated[list[Mention], FEW]], FEW] = {}


class RcSets(Message, frozen=True):
    """Answer to ``FindRcs``: kind → name, one entry a possible set, in the mission file's order; never empty."""

    sets: Annotated[list[Annotated[dict[Mention, Mention], FEW]], MANY]


class NoSuchHardware(Refusal):
    """No set of existing RCs fits the wish; the detail says which part of it nothing fits."""

    code = "dependency_database.none"
    remedy = "Wish for less, or add the hardware to the mission file."


DependencyDatabaseQuestion = AskResources | FindRcs
