"""The part of the bus that one page watches: the list of keys, or one key. Pure."""

from __future__ import annotations

from collections.abc import Set
from typing import NamedTuple

from backbone.errors import Refusal
from backbone.keys import COPIED, Conversation
from backbone.naming import did_you_mean
from backbone.quality import NEVER_DROPPED
from ui_console.model.key_shown import KeyOrder
from ui_console.web.protocol import ListKeys, ViewKey

LIST_STREAM = "/keys"
"""Streams of a page's outbox beside those of robots, whose names have no slash."""
"""Copies are shown under the keys of the copied messages."""
NO_MESSAGES = COPIED | {Conversation.ALIVE}
"""In a running mission tokens are not messages; a recording has a message for each appearance and withdrawal."""


class NoSuchKey(Refusal):
    """No message can have this key."""

    code = "web.key"
    remedy = "Choose a key of the list."


class KeySight(NamedTuple):
    """The list or key that a page watches.

    Attributes:
        is_listed: The list of keys is open.
        words: Search words of the list.
        order: Order of the list.
        number: Number of the view, chosen by the page; data of an earlier view have another number.
        key: Key of the view, without ``scout/<mission>/``; empty: no view is open.
        source: Sender of the viewed messages.
        schema: Schema of the viewed messages.
    """

    is_listed: bool = False
    words: str = ""
    order: KeyOrder = KeyOrder.KEY
    number: int = 0
    key: str = ""
    source: str = ""
    schema: str = ""

    @property
    def view(self) -> tuple[str, str, str] | None:
        """Key, sender and schema of the view; None: no view is open."""
        return (self.key, self.source, self.schema) if self.key else None

    @property
    def fields_stream(self) -> str:
        """Name of the stream of the view's messages."""
        return f"/fields/{self.number}"

    @property
    def picture_stream(self) -> str:
        """Name of the stream of the view's pictures."""
        return f"/picture/{self.number}"

    @property
    def streams(self) -> frozenset[str]:
        """All streams for the page."""
        listed = {LIST_STREAM} if self.is_listed else set[str]()
        return frozenset(listed | ({self.fields_stream, self.picture_stream} if self.key else set()))

    def after(self, intent: ListKeys | ViewKey, hidden: Set[Conversation] = NO_MESSAGES) -> KeySight:
        """Return the page's view after an intent.

        Args:
            intent: The page's intent.
            hidden: Conversations that pages cannot view.

        Raises:
            NoSuchKey: No message can be sent at that key.
        """
        match intent:
            case ListKeys(is_open, words, order):
                return self._replace(is_listed=is_open, words=words, order=order)
            case ViewKey(number, key, source, schema):
                if key:
                    conversation_of(key, hidden)
                return self._replace(number=number, key=key, source=source, schema=schema)


def conversation_of(key: str, hidden: Set[Conversation] = NO_MESSAGES) -> Conversation:
    """Return the conversation of a key, which must not be hidden.

    Raises:
        NoSuchKey: The key has no conversation that pages can view.
    """
    known = {one.value: one for one in Conversation if one not in hidden}
    address, _, name = key.rpartition("/")
    if name not in known or "/" not in address:
        raise NoSuchKey(f"no message is sent at {key}{did_you_mean(name, known)}")
    return known[name]


def where_heard(key: str, source: str) -> tuple[Conversation, str]:
    """Return the component and conversation to overhear for a key, so that no other component makes copies.

    Args:
        key: Without ``scout/<mission>/``.
        source: Sender of the messages.

    Raises:
        NoSuchKey: No message can be sent at that key.
    """
    address, conversation = key.rpartition("/")[0], conversation_of(key)
    if conversation is Conversation.ASK:
        return Conversation.TOLD, address  # the component that answers also copies questions
    if conversation in NEVER_DROPPED:
        return Conversation.TOLD, source or address
    return conversation, address
