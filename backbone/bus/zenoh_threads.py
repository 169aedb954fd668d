"""Number of zenoh's threads in this process, set in its environment before the first session is opened."""

from __future__ import annotations

import os

_RUNTIME = "ZENOH_RUNTIME"  # zenoh 1.10 reads it when the first session of a process opens
_OF_A_CLIENT = "(net:(handover:rx),acc:(handover:rx),app:(handover:rx),rx:(worker_threads:1))"
"""One thread sends; the other receives and does the rest. A sixth thread would only pass on the received messages. The
sender stays apart, so that the link is kept alive while a receiver waits for Python."""
_OF_A_HUB = "(acc:(handover:tx))"
"""The sending thread owns the sockets, because no message can block it. A full queue to a slow client blocks a thread
that receives; if that thread owned the sockets, nothing could empty the queue."""


def few_threads() -> None:
    """Make zenoh use two threads in this process, which opens sessions of clients only.

    A hub needs more threads: if one thread receives and sends, a flood that blocks receiving also blocks sending.
    """
    os.environ.setdefault(_RUNTIME, _OF_A_CLIENT)


def threads_of_a_hub() -> None:
    """Make zenoh use its default threads in this process, but none that only accepts."""
    os.environ[_RUNTIME] = _OF_A_HUB
