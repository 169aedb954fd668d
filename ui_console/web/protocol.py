"""Messages of a page of the console.

A message is a JSON object whose ``do`` names one of these; an unknown field makes it invalid.
"""

from __future__ import annotations

from typing import Annotated, Any

import msgspec

from backbone.mission_log.question import LogQuestion
from backbone.ranges import EXACT, LONGEST_LINE, LONGEST_MENTION, Meters, Name, NameOrNone, PixelCount
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
Robots = Annotated[list[Name], msgspec.Meta(min_length=1, max_length=MOST_ORDERED)]
PixelPoint = Annotated[float, msgspec.Meta(ge=-0.5, le=8_192.0)]
Share = Annotated[float, msgspec.Meta(ge=-1.0, le=1.0)]


class Steer(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="drive"):
    """A stick, key or pad is held; lasts for ``driving.STICK_LASTS_S`` and must be repeated meanwhile.

    Attributes:
        moment: ``OwnView.moment`` that the page showed when the press began; at a later moment the press moves nothing.
        forward: −1 (full backward) to 1.
        right: −1 (full left) to 1.
        speed: Share of the robot's largest speed at full stick.
    """

    moment: Numbered
    forward: Share
    right: Share
    speed: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]


class StopWheels(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="stop"):
    """The control was released."""


class GiveRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="give"):
    """Send one command to the held robot.

    Attributes:
        moment: As in ``Steer``.
        word: Word of the command.
        values: Field → value; the ARC checks them.
        role: Role of the RC that obeys it.
    """

    moment: Numbered
    word: ShortText
    values: Annotated[dict[ShortText, GivenValue], msgspec.Meta(max_length=MOST_FIELDS)]
    role: ShortText


class OrderRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="order"):
    """Give robots an order.

    Attributes:
        moment: As in ``Steer``.
        kind: Kind of order.
        robots: Names of the robots; goals are side by side.
        x_m: Goal.
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
    """Order robots to go to the place on the floor at a point of a robot's picture.

    Attributes:
        moment: As in ``Steer``.
        robot: Robot whose camera took the picture.
        robots: Robots that go there.
        column_px: 0: the middle of the leftmost pixel.
        row_px: 0: the middle of the uppermost pixel.
        width_px: Width of the picture.
        height_px: Height of the picture.
    """

    moment: Numbered
    robot: ShortText
    robots: Robots
    column_px: PixelPoint
    row_px: PixelPoint
    width_px: PixelCount
    height_px: PixelCount


class EndOrders(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="end_orders"):
    """End the orders of these robots: the stick keeps the robot at the stick, the others return to the mission."""

    robots: Robots


class TakeOver(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="take"):
    """Claim a robot.

    Attributes:
        robot: Its name; empty: any free one with a camera.
        kind: Kind of ARC; empty: the present kind for the same robot, else a kind that fits the robot.
    """

    robot: NameOrNone
    kind: NameOrNone = ""


class MayI(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="may_i"):
    """Ask the operator who holds the robot for which this operator waits."""

    why: Annotated[str, msgspec.Meta(max_length=MAX_WHY)] = ""


class Decide(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="decide"):
    """Answer an operator's question for the robot (a yes releases it) or for the lift of a stop.

    Attributes:
        number: Number of the question on the page; if another one is open now, it is not answered.
    """

    is_given: bool
    number: Numbered


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
    """Show exactly the pictures of these robots."""

    robots: Annotated[list[ShortText], msgspec.Meta(max_length=MOST_WATCHED)]


class Drawn(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="drawn"):
    """A picture is on the screen, so the next may be sent."""

    robot: ShortText
    number: Annotated[int, msgspec.Meta(ge=0, le=2**32 - 1)]


class LookInto(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="look"):
    """Show the debug views of a behavior, and the pictures of one of them.

    Attributes:
        behavior: Name; empty: no behavior.
        view: Name of the picture; empty: none.
    """

    behavior: ShortText = ""
    view: ShortText = ""


class ListKeys(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="list_keys"):
    """Show the keys on the bus with their message rates; while no page shows them, messages are not counted.

    Attributes:
        is_open: False: show none.
        words: Only rows that contain all of these words in key, sender or schema.
        order: Order of the rows.
    """

    is_open: bool
    words: ShortText = ""
    order: KeyOrder = KeyOrder.KEY


class ViewKey(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="view_key"):
    """Show the newest message of exactly one key.

    Attributes:
        number: Returned in the names of the streams.
        key: Key in the list; empty: show none.
        source: Sender of the messages.
        schema: Schema of the messages.
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
        number: Returned with the result.
    """

    number: Numbered


class MoreLog(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="more_log"):
    """Send the next part of the result.

    Attributes:
        number: Of the search.
        first: Number of events that the page already has.
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
    value: Any  # a JSON value; the component checks it


class Here(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="here"):
    """The operator used the page, or the page lost the focus."""

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
