"""Messages of a page of the console.

A message is a JSON object whose ``do`` names one of these; an unknown field makes it invalid.
"""

from __future__ import annotations

from typing import Annotated, Any

import msgspec

from backbone.mission_log.question import LogQuestion
from backbone.ranges import EXACT, LONGEST_LINE, LONGEST_MENTION, Meters, PixelCount
from ui_console.model.consent import MAX_WHY
from ui_console.model.key_shown import KeyOrder
from ui_console.model.orders import OrderKind
from ui_console.web.login import BeatRequest, Hello, ShortText

MOST_WATCHED = 16  # chosen: more pictures than a wall screen shows

ShortLine = Annotated[str, msgspec.Meta(max_length=LONGEST_LINE)]
MOST_ORDERED = 32  # chosen: more robots than one person can have in view
MOST_FIELDS = 64  # chosen: more than a person fills in

GivenValue = Annotated[int, msgspec.Meta(ge=-EXACT, le=EXACT)] | float | bool | ShortLine
KeyText = Annotated[str, msgspec.Meta(max_length=LONGEST_MENTION, pattern=r"^([a-z_]+(/[A-Za-z0-9_.-]+)+)?\Z")]
"""A key of one component without ``scout/<mission>/``, or an address; empty: none."""
Numbered = Annotated[int, msgspec.Meta(ge=0, le=EXACT)]
Robots = Annotated[list[ShortText], msgspec.Meta(min_length=1, max_length=MOST_ORDERED)]
PixelPoint = Annotated[float, msgspec.Meta(ge=-0.5, le=8_192.0)]
Share = Annotated[float, msgspec.Meta(ge=-1.0, le=1.0)]


class Steer(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="drive"):
    """A stick, key or pad is held; counts for ``driving.STICK_LASTS_S`` and has to be repeated meanwhile.

    Attributes:
        moment: ``OwnView.moment`` as the page showed it when the press began; at a later one the press moves nothing.
        forward: −1 (full backward) to 1.
        right: −1 (full left) to 1.
        speed: Share of the robot's most at full stick.
    """

    moment: Numbered
    forward: Share
    right: Share
    speed: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]


class StopWheels(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="stop"):
    """The control was let go."""


class GiveRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="give"):
    """Give one command to the robot in hand.

    Attributes:
        moment: As in ``Steer``.
        word: The command's.
        values: Field → value; the ARC checks them.
        role: Role of the RC that obeys it.
    """

    moment: Numbered
    word: ShortText
    values: Annotated[dict[ShortText, GivenValue], msgspec.Meta(max_length=MOST_FIELDS)]
    role: ShortText


class OrderRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="order"):
    """Tell robots to do something by themselves.

    Attributes:
        moment: As in ``Steer``.
        kind: What they are to do.
        robots: Their names; places to go to lie side by side.
        x_m: Of the place to go to.
        y_m: Same.
        target: The body to follow.
    """

    moment: Numbered
    kind: OrderKind
    robots: Robots
    x_m: Meters = 0.0
    y_m: Meters = 0.0
    target: ShortText = ""


class PictureOrder(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="order_in_picture"):
    """Tell robots to go to the place on the floor that a point of a robot's picture shows.

    Attributes:
        moment: As in ``Steer``.
        robot: The picture is its camera's.
        robots: Who is to go there.
        column_px: 0: the middle of the leftmost pixel.
        row_px: 0: the middle of the uppermost pixel.
        width_px: Of the picture.
        height_px: Same.
    """

    moment: Numbered
    robot: ShortText
    robots: Robots
    column_px: PixelPoint
    row_px: PixelPoint
    width_px: PixelCount
    height_px: PixelCount


class EndOrders(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="end_orders"):
    """End the orders of these robots: the robot at the stick stays in hand, the others go back to the mission."""

    robots: Robots


class TakeOver(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="take"):
    """Claim a robot.

    Attributes:
        robot: Its name; empty: any free one with a camera.
        kind: Kind of ARC; empty: that of now for the same robot, else one for the robot.
    """

    robot: ShortText
    kind: ShortText = ""


class MayI(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="may_i"):
    """Ask the operator who holds the robot this one waits for."""

    why: Annotated[str, msgspec.Meta(max_length=MAX_WHY)] = ""


class Decide(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="decide"):
    """Answer the operator who asks: for the robot, which is given back with a yes, or to lift a stop."""

    is_given: bool


class DismissLost(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="dismiss_lost"):
    """The operator has seen that a robot was lost."""


class ReleaseRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="release"):
    """Give the robot back."""


class StopRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="stop_robot"):
    """Emergency stop of one robot; needs no grant."""

    robot: ShortText


class StopAllRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="stop_all"):
    """Emergency stop of all robots."""


class LiftRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="lift"):
    """Lift the stop of this number, as shown on the page."""

    robot: ShortText
    number: Numbered


class Watch(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="watch"):
    """Show the pictures of these robots, and of no others."""

    robots: Annotated[list[ShortText], msgspec.Meta(max_length=MOST_WATCHED)]


class Drawn(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="drawn"):
    """A picture is on the screen, which makes room for the next."""

    robot: ShortText
    number: Annotated[int, msgspec.Meta(ge=0, le=2**32 - 1)]


class LookInto(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="look"):
    """Show the debug views of a behavior, and the pictures of one of them.

    Attributes:
        behavior: Name; empty: look into none.
        view: Name of the picture; empty: none.
    """

    behavior: ShortText = ""
    view: ShortText = ""


class ListKeys(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="list_keys"):
    """Show the keys on the bus, and how much is said at each; while no page does, nothing is counted.

    Attributes:
        is_open: False: show none.
        words: Only rows with all of these in key, sender or schema.
        order: Of the rows.
    """

    is_open: bool
    words: ShortText = ""
    order: KeyOrder = KeyOrder.KEY


class ViewKey(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="view_key"):
    """Show the newest message of one key, and of no other.

    Attributes:
        number: Comes back in the names of the streams with what is shown.
        key: As in the list; empty: show none.
        source: Sender of the messages.
        schema: Theirs.
    """

    number: Numbered
    key: KeyText = ""
    source: KeyText = ""
    schema: Annotated[str, msgspec.Meta(max_length=LONGEST_MENTION)] = ""


class WhyRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="why"):
    """Explain the state of a component or request."""

    name: ShortText


class SearchLog(LogQuestion, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="search_log", kw_only=True):
    """Search the mission's log.

    Attributes:
        number: Comes back with the result.
    """

    number: Numbered


class MoreLog(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="more_log"):
    """Send the next part of the result.

    Attributes:
        number: Of the search.
        first: How many events of it the page has.
    """

    number: Numbered
    first: Numbered


class Acknowledge(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="acknowledge"):
    """Acknowledge an alarm; with an empty key all."""

    key: Annotated[str, msgspec.Meta(max_length=256)] = ""


class ParametersRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="parameters"):
    """Ask a component for its parameters."""

    name: ShortText


class SetRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="set"):
    """Set a parameter of a component."""

    name: ShortText
    parameter: ShortText
    value: Any  # as JSON has it; the component checks it


class Here(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="here"):
    """The operator touched the page, or it is no longer in front."""

    is_there: bool


Intent = (
    Steer
    | StopWheels
    | GiveRequest
    | OrderRequest
    | PictureOrder
    | EndOrders
    | TakeOver
    | ReleaseRequest
    | MayI
    | Decide
    | DismissLost
    | StopRequest
    | StopAllRequest
    | LiftRequest
    | Watch
    | Drawn
    | LookInto
    | ListKeys
    | ViewKey
    | WhyRequest
    | SearchLog
    | MoreLog
    | Acknowledge
    | ParametersRequest
    | SetRequest
    | Here
)
_intents: msgspec.json.Decoder[Hello | BeatRequest | Intent] = msgspec.json.Decoder(Hello | BeatRequest | Intent)
understand = _intents.decode
"""Returns the decoded message; raises ``msgspec.DecodeError`` for one that is not valid."""
