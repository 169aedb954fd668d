"""Messages of a page of the designer.

A message is a JSON object whose ``do`` names one of these; an unknown field makes it invalid. A message that changes
the draft names its revision: a change of an older revision is refused.
"""

from __future__ import annotations

from typing import Annotated

import msgspec

from ui_console.web.login import MAX_MESSAGE_BYTES, BeatRequest, Hello

MOST_ANSWERS = 16  # chosen: twice the largest number that an element needs

Number = Annotated[int, msgspec.Meta(ge=0, le=100_000)]
PathSaid = Annotated[tuple[Number, ...], msgspec.Meta(max_length=32)]
Text = Annotated[str, msgspec.Meta(max_length=MAX_MESSAGE_BYTES)]


class Select(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="select"):
    """Show this element.

    Attributes:
        path: The element.
        number: Returned with the element, so that the page can match the answer to its choice.
    """

    path: PathSaid
    number: Annotated[int, msgspec.Meta(ge=0, le=2**53)] = 0


class TakeOffer(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="take"):
    """Take an offer at an element, or at its nearest ancestor with that offer.

    Attributes:
        revision: Of the draft to change.
        path: The element.
        label: Of the offer.
        answers: To its questions; none: the proposed ones, unless the offer must ask.
    """

    revision: int
    path: PathSaid
    label: Text
    answers: Annotated[tuple[Text, ...], msgspec.Meta(max_length=MOST_ANSWERS)] = ()


class SetProperty(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="set"):
    """Set an attribute or a parameter; an empty text removes it."""

    revision: int
    path: PathSaid
    name: Text
    value: Text
    is_parameter: bool = False


class MoveElement(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="move"):
    """Move an element.

    Attributes:
        revision: Of the draft to change.
        path: The element.
        parent: Its new parent.
        before: Its next sibling, by the sibling's present number; None: the element becomes the last one.
    """

    revision: int
    path: PathSaid
    parent: PathSaid
    before: Number | None = None


class RemoveElement(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="remove"):
    """Remove an element and its content."""

    revision: int
    path: PathSaid


class Undo(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="undo"):
    """Undo the last change."""

    revision: int


class Redo(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="redo"):
    """Redo the change undone last."""

    revision: int


class SaveFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="save"):
    """Save this revision.

    Attributes:
        revision: Of the draft.
        name: Another file of the same folder; empty: its own.
        overwrite: True: replace the changes of other programs.
    """

    revision: int
    name: Text = ""
    overwrite: bool = False


class TakeFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="reread"):
    """Take the file's present content; can be undone."""

    revision: int


class Rehearse(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="rehearse"):
    """Begin or stop showing the first minute of the schedule."""

    is_shown: bool


class LookUp(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="look_up"):
    """Ask a type's class for its documentation and parameters."""

    type: Text


class ReadText(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="text"):
    """Show the text as it would be saved."""


Change = TakeOffer | SetProperty | MoveElement | RemoveElement | Undo | Redo
"""Messages that change the draft only."""

DesignIntent = (
    Select
    | TakeOffer
    | SetProperty
    | MoveElement
    | RemoveElement
    | Undo
    | Redo
    | SaveFile
    | TakeFile
    | Rehearse
    | LookUp
    | ReadText
)
_intents: msgspec.json.Decoder[Hello | BeatRequest | DesignIntent] = msgspec.json.Decoder(
    Hello | BeatRequest | DesignIntent
)
understand_designer = _intents.decode
"""Returns the decoded message; raises ``msgspec.DecodeError`` for one that is not valid."""
