"""What a page of the designer may say.

A message is a JSON object whose ``do`` says which of these it is; anything else in it makes it meaningless. What alters
the draft names the revision it was meant for: nobody moves an element that was another one a moment ago.
"""

from __future__ import annotations

from typing import Annotated

import msgspec

from ui_console.web.login import BeatRequest, Hello

MOST_TEXT = 1024  # chosen: longer than any value a mission needs; a message is 4096 bytes at most
MOST_ANSWERS = 16  # chosen: twice what any element asks for

Number = Annotated[int, msgspec.Meta(ge=0, le=100_000)]
PathSaid = Annotated[tuple[Number, ...], msgspec.Meta(max_length=32)]
Text = Annotated[str, msgspec.Meta(max_length=MOST_TEXT)]


class Select(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="select"):
    """Show all about this element.

    Attributes:
        path: The element.
        number: Told back with what is shown, so that a page knows to which of its choices it belongs.
    """

    path: PathSaid
    number: Annotated[int, msgspec.Meta(ge=0, le=2**53)] = 0


class TakeOffer(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="take"):
    """Add something to an element, or to the nearest above it that can hold it.

    Attributes:
        revision: Of the draft it was meant for.
        path: The element.
        label: Of the offer.
        answers: To what it asks; none: ask if something has to be asked, else as proposed.
    """

    revision: int
    path: PathSaid
    label: Text
    answers: Annotated[tuple[Text, ...], msgspec.Meta(max_length=MOST_ANSWERS)] = ()


class SetProperty(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="set"):
    """Set an attribute or a parameter; empty text leaves it out."""

    revision: int
    path: PathSaid
    name: Text
    value: Text
    is_parameter: bool = False


class MoveElement(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="move"):
    """Put an element elsewhere.

    Attributes:
        revision: Of the draft it was meant for.
        path: The element.
        parent: Where it goes in.
        before: The sibling it shall stand before, by its number as it is now; None: last.
    """

    revision: int
    path: PathSaid
    parent: PathSaid
    before: Number | None = None


class RemoveElement(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="remove"):
    """Remove an element and all in it."""

    revision: int
    path: PathSaid


class Undo(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="undo"):
    """Take the last change back."""

    revision: int


class Redo(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="redo"):
    """Do again what was taken back."""

    revision: int


class SaveFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="save"):
    """Save what this revision is.

    Attributes:
        revision: Of the draft.
        name: Another file of the same folder; empty: the one it is from.
        overwrite: Whether to replace what somebody else wrote there.
    """

    revision: int
    name: Annotated[str, msgspec.Meta(max_length=128)] = ""
    overwrite: bool = False


class TakeFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="reread"):
    """Have what the file holds now; can be undone."""

    revision: int


class Rehearse(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="rehearse"):
    """Show the first minute of the schedule from now on, or no more."""

    is_shown: bool


class LookUp(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="look_up"):
    """Ask a type's class for its documentation and parameters."""

    type: Text


class ReadText(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="text"):
    """Show the text as it would be saved."""


Change = TakeOffer | SetProperty | MoveElement | RemoveElement | Undo | Redo
"""What alters the draft, and nothing else."""

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


def understand_designer(data: bytes | str) -> Hello | BeatRequest | DesignIntent:
    """Return what a message means.

    Raises:
        msgspec.DecodeError: Nothing.
    """
    return _intents.decode(data)
