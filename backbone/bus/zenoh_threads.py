"""How many threads zenoh starts in this process; said in its environment, before the first session is opened."""

from __future__ import annotations

import os

_RUNTIME = "ZENOH_RUNTIME"  # zenoh 1.10 reads it when the first session of a process opens
_OF_A_CLIENT = "(net:(handover:rx),acc:(handover:rx),app:(handover:rx),rx:(worker_threads:1))"
"""One thread receives and does the rest, one sends. A sixth thread would only pass on what the first has read. The
sender stays apart, so that the link is kept alive while a receiver waits for Python."""
_OF_A_HUB = "(acc:(handover:tx))"
"""The sockets belong to the thread that sends, which no message can block. One that receives is blocked by a full queue
to a slow client; if it had the sockets too, nothing could empty that queue."""


def few_threads() -> None:
    """Have two threads of zenoh in this process, which opens sessions of clients only.

    A hub needs more: where one thread receives and sends, a flood that blocks the one blocks the other.
    """
    os.environ.setdefault(_RUNTIME, _OF_A_CLIENT)


def threads_of_a_hub() -> None:
    """Have zenoh's own threads in this process, but none that only accepts."""
    os.environ[_RUNTIME] = _OF_A_HUB
