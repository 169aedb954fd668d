"""Answers of the designer's server to one page; the page recognizes the kind of an answer by its fields."""

from __future__ import annotations

import msgspec

from backbone.mission.edit import Path
from ui_console.design.views import OfferView


class AskAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An offer that needs answers to its questions before it is applied at an element."""

    ask: OfferView
    path: Path


class RefusalAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The server refuses a message of the page.

    Attributes:
        refused: The reason.
        remedy: Advice; may be empty.
        is_change: True: the message was to change, save or read the draft.
    """

    refused: str
    remedy: str
    is_change: bool


class FileChangedAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Another program changed the file; the draft is not saved.

    Attributes:
        file_changed: The event, for people.
        name: Another file in the same folder for the draft; empty: its own.
    """

    file_changed: str
    name: str


class NoticeAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A notice to a designer, not an answer to the page's last message."""

    notice: str
    remedy: str


class SavedAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The draft is saved in this file, with this number of problems."""

    saved: str
    problems: int


class TextAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The text as it would be saved, the line of the chosen element, and the mission file."""

    text: str
    line: int
    source: str


DesignAnswer = AskAnswer | RefusalAnswer | FileChangedAnswer | NoticeAnswer | SavedAnswer | TextAnswer
