"""Selects messages from the bytes that are overheard on the bus. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase

from backbone.keys import COPIED, Conversation
from backbone.quality import NEVER_DROPPED
from backbone.recording.translation import Translated, Translator, copies_in
from backbone.wire import Message

_OVERHEARD_AS_COPIES = frozenset({*NEVER_DROPPED, Conversation.ASK})
_TOLD = f"/{Conversation.TOLD}"
_DIRECT = tuple(one for one in Conversation if one not in {*_OVERHEARD_AS_COPIES, *COPIED, Conversation.ALIVE})


class Hearing:
    """Selects and translates overheard messages.

    Args:
        classes: Known message classes, by schema.
        keys: Patterns of the selected keys, see ``is_meant``; none: all.
    """

    def __init__(self, classes: Mapping[str, type[Message]], keys: Sequence[str] = ()) -> None:
        self._translator, self._keys = Translator(classes), tuple(keys)

    def heard(self, key: str, raw: bytes, at_s: float) -> list[tuple[str, Translated]]:
        """Return the selected messages with their keys; ``Told`` is unpacked into copies with their original keys.

        Args:
            key: Key at which the bytes were overheard.
            raw: The bytes.
            at_s: Mission time of their arrival.
        """
        translate, keys = self._translator.translate, self._keys
        return [
            (said_at, translate(envelope, at_s))
            for said_at, envelope in unfolded(key, raw)
            if not keys or is_meant(said_at, keys)
        ]


def unfolded(key: str, raw: bytes) -> list[tuple[str, bytes]]:
    """Return key and envelope of overheard bytes; ``Told`` is unpacked into copies with their original keys."""
    told = copies_in(raw) if key.endswith(_TOLD) else None
    if told is None:
        return [(key, raw)]
    mission = "/".join(key.split("/")[:2])
    return [
        (f"{mission}/{copies.address}/{copies.conversation}", quoted) for copies in told for quoted in copies.messages
    ]


def is_meant(key: str, patterns: Sequence[str]) -> bool:
    """Return whether a key matches one of these patterns, with or without the prefix ``scout/<mission>/``.

    Example:
        >>> is_meant("scout/iros2001/resource_pool/scout1/telemetry", ("*/scout1/*",))
        True
    """
    short = key.split("/", 2)[-1]
    return any(fnmatchcase(key, pattern) or fnmatchcase(short, pattern) for pattern in patterns)


def to_overhear(patterns: Sequence[str]) -> list[Conversation]:
    """Return the conversations to overhear for keys that match a pattern, copies first.

    Declarations arrive everywhere in this order. Therefore, a publisher that knows of a later subscription also knows
    that copies are wanted.

    Example:
        >>> [one.value for one in to_overhear(("resource_pool/*/readings",))]
        ['readings']
        >>> [one.value for one in to_overhear(("*/ask", "*/status", "*/log"))]
        ['told', 'log']
    """
    ends = {pattern.rpartition("/")[2] for pattern in patterns}
    if not ends or not ends <= set(Conversation):
        return [Conversation.TOLD, *_DIRECT]
    return [*([Conversation.TOLD] if ends & _OVERHEARD_AS_COPIES else []), *(one for one in _DIRECT if one in ends)]
