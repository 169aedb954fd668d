"""What one page looks at on the bus: the list of keys, or one of them. Pure."""

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
"""Copies are shown at the keys of what they copy."""
NO_MESSAGES = COPIED | {Conversation.ALIVE}
"""Tokens of a mission that is up are no messages; a recording has one for each rise and fall."""


class NoSuchKey(Refusal):
    """No message can be sent at this key."""

    code = "web.key"
    remedy = "Choose a key of the list."


class KeySight(NamedTuple):
    """What a page looks at.

    Attributes:
        is_listed: The list of keys is open.
        words: Only rows with these words.
        order: Of the list.
        number: Of the view, chosen by the page; what comes for an earlier view has another one.
        key: Of the view, without ``scout/<mission>/``; empty: none is open.
        source: Sender of the messages in view.
        schema: Theirs.
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
        """Key, sender and schema in view; None: no view is open."""
        return (self.key, self.source, self.schema) if self.key else None

    @property
    def fields_stream(self) -> str:
        """Name of the stream of its messages."""
        return f"/fields/{self.number}"

    @property
    def picture_stream(self) -> str:
        """Name of the stream of its pictures."""
        return f"/picture/{self.number}"

    @property
    def streams(self) -> frozenset[str]:
        """All streams that the page is to get."""
        listed = {LIST_STREAM} if self.is_listed else set[str]()
        return frozenset(listed | ({self.fields_stream, self.picture_stream} if self.key else set()))

    def after(self, intent: ListKeys | ViewKey, hidden: Set[Conversation] = NO_MESSAGES) -> KeySight:
        """Return what the page looks at then.

        Args:
            intent: The page's.
            hidden: Conversations that it cannot view.

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
    """Return the conversation of a key, which is none of the hidden ones.

    Raises:
        NoSuchKey: It has none that can be heard.
    """
    known = {one.value: one for one in Conversation if one not in hidden}
    address, _, name = key.rpartition("/")
    if name not in known or "/" not in address:
        raise NoSuchKey(f"no message is sent at {key}{did_you_mean(name, known)}")
    return known[name]


def where_heard(key: str, source: str) -> tuple[Conversation, str]:
    """Return which conversation to overhear for a key, and of whom, so that no other component makes copies.

    Args:
        key: Without ``scout/<mission>/``.
        source: Sender of the messages.

    Raises:
        NoSuchKey: No message can be sent at that key.
    """
    address, conversation = key.rpartition("/")[0], conversation_of(key)
    if conversation is Conversation.ASK:
        return Conversation.TOLD, address  # the one who answers copies questions too
    if conversation in NEVER_DROPPED:
        return Conversation.TOLD, source or address
    return conversation, address
