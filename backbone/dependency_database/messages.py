"""Messages to the static dependency database: existing hardware, and sets of it for an ARC."""

from __future__ import annotations

from typing import Annotated

from backbone.errors import Refusal
from backbone.ranges import FEW, MANY, Duration, Mention, Share, Values
from backbone.wire import Message


class Resource(Message, frozen=True, tag="Resource/2"):
    """One physical resource, and the launch of its RC.

    Attributes:
        name: Name of the resource and of its RC.
        type: Component type of its RC (``scout``, ``command_radio``, ``video_frequency``, ``framegrabber`` …).
        host: Host to which its hardware is wired; empty: any.
        sharable: True if several ARCs may share its capacity.
        capacity: Share of its time that it can give, 0 to 1; 1 for unit resources.
        connect_s: Settling time after a connection, seconds.
        disconnect_s: Release time, seconds.
        driver: Name of its RC's driver.
        parameters: Further parameters of its RC.
        features: Its features, which a search may ask for (``camera``).
        links: The only resources with which it can be combined, by kind (a framegrabber's ``video_frequency``, a
            scout's ``command_radio``).
        process: Name of its RC's shared process; empty: a process of its own.
        is_robot: True if it is a robot, which operators can stop.
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
    is_robot: bool = False

    def rc_parameters(self) -> dict[str, object]:
        """Return the parameters of its RC's launch: driver, sharing and links, then its own."""
        common = {"driver": self.driver, "sharable": self.sharable, "capacity": self.capacity, "links": self.links}
        return {**common, **self.parameters}


class AskResources(Message, frozen=True):
    """Ask for all hardware."""


class Resources(Message, frozen=True):
    """Answer to ``AskResources``, sorted by name."""

    resources: Annotated[list[Resource], MANY]


class HardwareChanged(Message, frozen=True):
    """Published under ``Conversation.EVENTS`` when hardware was added or removed: ask ``AskResources`` again."""


class FindRcs(Message, frozen=True, tag="FindRcs/2"):
    """Ask for the sets of RCs that match.

    Attributes:
        roles: Role → kind of RC that the ARC needs for it: ``{"scout": "scout", "left_eye": "camera"}``.
        wish: Role → name wanted for it; a role that is left out may have any RC.
        features: Role → features wanted for it.
    """

    roles: Annotated[dict[Mention, Mention], FEW]
    wish: Annotated[dict[Mention, Mention], MANY] = {}
    features: Annotated[dict[Mention, Annotated[list[Mention], FEW]], FEW] = {}


class RcSets(Message, frozen=True, tag="RcSets/2"):
    """Answer to ``FindRcs``.

    Attributes:
        sets: One entry role → name for each set, in the order of the mission file; never empty.
        sharable: Names of the RCs in these sets that several ARCs may share.
    """

    sets: Annotated[list[Annotated[dict[Mention, Mention], FEW]], MANY]
    sharable: Annotated[list[Mention], MANY] = []


class NoSuchHardware(Refusal):
    """No set of existing RCs matches the wish; the detail names the part without a match."""

    code = "dependency_database.none"
    remedy = "Ask for fewer names or features, or add the hardware to the mission file."


DependencyDatabaseQuestion = AskResources | FindRcs
