"""Key expressions: ``scout/<mission>/<subsystem>/<component>/<conversation>``.

Only this file knows the form of a key. Components use addresses (``<subsystem>/<component>``, see ``naming.address``)
and conversations.
"""

from __future__ import annotations

import re
from enum import StrEnum
from functools import lru_cache

from backbone.naming import IllegalName

ROOT = "scout"
KEY_OF_HUB = f"{ROOT}/hub"
"""Key of the token of a hub, which every client of it finds."""
_ANY = "+"  # replaces * in the key of a token, which cannot contain *
_SEGMENT = re.compile(r"\*|[^@/*$#?][^/*$#?]*")  # a legal segment of a key expression, or * for any segment


class Conversation(StrEnum):
    """Kind of message under a component's address, the last segment of its key."""

    ASK = "ask"  # questions: request/response
    TOLD = "told"  # copies of messages that recorders cannot overhear themselves, while there is a recorder
    FAR = "far"  # copies of all but pictures, from processes without a socket to the mission's recorder
    ALIVE = "alive"  # liveliness token, declared last: it means ready
    STATUS = "status"  # life-cycle state and feedback, on change
    COMMAND = "command"  # commands without an answer: packets on the simulated air, at the address of their receiver
    TELEMETRY = "telemetry"  # states of RCs and hosts
    BODIES = "bodies"  # states of all bodies of a simulated world, once a frame
    MOTIONS = "motions"  # commands that a robot's RC has applied, and its halts without a command
    REPLIES = "replies"  # replies of robots, as bytes, from a radio to the robots' RCs
    READINGS = "readings"  # measurements of the hardware, by name
    POSES = "poses"  # believed places of robots, from a localizer
    SIGHTINGS = "sightings"  # landmarks that behaviors see in robots' pictures
    FRAMES = "frames"  # pictures
    OUTPUTS = "outputs"  # values that an execution unit's modules produce for others
    VIEWS = "views"  # debug views of a behavior, while a person looks at them
    EVENTS = "events"  # findings of a behavior or world
    OPERATORS = "operators"  # actions of people, one event each
    SCHEDULE = "schedule"  # the RC manager's decisions and leases
    DECISIONS = "decisions"  # all that the RC manager decided on, for recorders
    LEASES = "leases"  # the RC manager's renewals of holds
    BEAT = "beat"  # heartbeats of ARCs: their event loop and their owner's run
    HEALTH = "health"  # the launcher's verdict on the whole mission
    LOG = "log"


COPIED = frozenset({Conversation.TOLD, Conversation.FAR})
"""Conversations of copies of messages that were sent at other keys."""


@lru_cache(maxsize=4096)
def key(mission: str, address: str, conversation: Conversation) -> str:
    """Return the key of one conversation of one component, or of many with ``*`` in the address.

    Example:
        >>> key("iros2001", "resource_pool/scout1", Conversation.ASK)
        'scout/iros2001/resource_pool/scout1/ask'

    Raises:
        IllegalName: Mission or address cannot be part of a key.
    """
    for segment in (mission, *address.split("/")):
        if _SEGMENT.fullmatch(segment) is None:
            raise IllegalName(f"{segment!r} in {mission}/{address} cannot be part of a key", name=segment)
    return f"{ROOT}/{mission}/{address}/{conversation}"


def key_of_all(mission: str, conversation: Conversation) -> str:
    """Return the key expression of one conversation of all components.

    Example:
        >>> key_of_all("iros2001", Conversation.TELEMETRY)
        'scout/iros2001/**/telemetry'

    Raises:
        IllegalName: The mission cannot be part of a key.
    """
    if _SEGMENT.fullmatch(mission) is None:
        raise IllegalName(f"{mission!r} cannot be part of a key", name=mission)
    return f"{ROOT}/{mission}/**/{conversation}"


def key_of_senders(of: str) -> str:
    """Return the key expression of the tokens of all senders of one key."""
    return f"{of}/by/**"


def key_of_sender(of: str, source: str) -> str:
    """Return the key of the token of one sender.

    Example:
        >>> key_of_sender("scout/iros2001/resource_pool/watch/frames", "resource_pool/framegrabber1")
        'scout/iros2001/resource_pool/watch/frames/by/resource_pool/framegrabber1'
    """
    return f"{of}/by/{source}"


def sender_of(of: str, token: str) -> str:
    """Return the sender of a key that declared this token.

    Example:
        >>> sender_of("scout/iros2001/backbone/by/frames", "scout/iros2001/backbone/by/frames/by/backbone/by")
        'backbone/by'
    """
    return token.removeprefix(f"{of}/by/")


def key_of_lossless(of: str, listener: str) -> str:
    """Return the key of a lossless listener to these keys: its token and the messages for it have this key.

    Example:
        >>> key_of_lossless("scout/iros2001/resource_pool/*/frames", "1f")
        'scout/iros2001/resource_pool/+/frames/all/1f'
    """
    return f"{of.replace('*', _ANY)}/all/{listener}"


def keys_of_lossless(mission: str) -> str:
    """Return the key expression of the tokens of all lossless listeners."""
    return f"{ROOT}/{mission}/**/all/*"


def listened_to(token: str) -> str:
    """Return the keys to which the lossless listener with this token listens.

    Example:
        >>> listened_to("scout/iros2001/resource_pool/+/frames/all/1f")
        'scout/iros2001/resource_pool/*/frames'
    """
    return token.rsplit("/", 2)[0].replace(_ANY, "*")


def is_key(text: str) -> bool:
    """Return whether the text has the parts of a concrete key, so that ``address_of`` can be asked.

    Example:
        >>> is_key("scout/iros2001/resource_pool/scout1/ask"), is_key("/camera/image")
        (True, False)
    """
    root, *others = text.split("/")
    return root == ROOT and len(others) > 2


def address_of(key_expression: str) -> str:
    """Return the address in a concrete key.

    Example:
        >>> address_of("scout/iros2001/resource_pool/scout1/ask")
        'resource_pool/scout1'
    """
    _root, _mission, *address, _conversation = key_expression.split("/")
    return "/".join(address)
