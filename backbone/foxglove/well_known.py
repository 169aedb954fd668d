"""Messages in Foxglove's well-known schemas, which Foxglove, Lichtblick and Rerun show without a plug-in. Pure.

A package lists its tables of translations as entry points of the group ``scout_backbone.foxglove``: message class → a
function from such a message to well-known ones that show it. They are encoded as Protocol Buffers, because Rerun
reads these schemas in no other encoding.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import Any, Protocol

from foxglove import Schema
from foxglove.messages import Timestamp

from backbone.errors import complaint
from backbone.wire import Message

log = logging.getLogger(__name__)

GROUP = "scout_backbone.foxglove"
ENCODING = "protobuf"
LATEST_S = 2**32 - 1  # google.protobuf.Timestamp as the SDK has it: whole seconds are a uint32


class Encodable(Protocol):
    """A message of Foxglove's SDK."""

    @staticmethod
    def get_schema() -> Schema:
        """Return its schema."""

    def encode(self) -> bytes:
        """Return its bytes."""


@dataclass(frozen=True, slots=True)
class WellKnown:
    """A translation of a message to one of Foxglove's schemas.

    Attributes:
        topic: One topic for each shown object, because tools keep showing the last message of each topic.
        message: The message in Foxglove's schema.
        is_all: True: the translation is complete, so that the original need not be shown beside it.
    """

    topic: str
    message: Encodable
    is_all: bool = False


Translations = Mapping[type[Message], Callable[[Any], Iterable[WellKnown]]]


def installed() -> Translations:
    """Return the translations of the installed packages; a table that cannot be loaded is left out."""
    found: dict[type[Message], Callable[[Any], Iterable[WellKnown]]] = {}
    for entry in entry_points(group=GROUP):
        try:
            found |= entry.load()
        except (Exception, SystemExit) as error:  # a module that is being written raises anything
            log.warning("the translations of %s are left out: %s", entry.name, complaint(error))
    return found


def shown_as(message: Message | None, translations: Translations) -> list[WellKnown]:
    """Return the translations of this message; empty if there is no message, or no translation of its class."""
    translation = translations.get(type(message)) if message is not None else None
    return [*translation(message)] if translation is not None else []


def moment(at_s: float) -> Timestamp:
    """Return a mission time, limited to the times that Foxglove can represent."""
    return Timestamp.from_epoch_secs(min(max(at_s, 0.0), LATEST_S))
