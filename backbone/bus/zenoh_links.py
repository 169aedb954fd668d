"""Links of a session over TCP: they have our options, and a client's link without messages is replaced.

After a cut, a new address, or a loss of many packets, a new connection of zenoh 1.10 may be *deaf*: it stays up and
keeps itself alive, but passes no message to the client for ever. The hub declares a token, which a client finds over
every other connection. If a client does not find it, this file ends the connection; then the session connects again by
itself. A connection over which more than keep-alives came is not deaf: the answer waits behind other messages.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from contextlib import suppress

import zenoh

from backbone.bus.sockets import received_bytes, set_options, shut_down
from backbone.keys import KEY_OF_HUB

log = logging.getLogger(__name__)

LOOK_EACH_S = 1.0  # chosen: the hub's token is known milliseconds after a connection, on a busy machine within 1 s
ANSWER_WITHIN_S = 2.0  # chosen: a link without any message for this time counts as cut
SLOWEST_ANSWER_S = 4.0  # chosen: with such a round trip no command arrives in time
KEEP_ALIVES_BYTES = 512  # chosen: many times the keep-alives of zenoh 1.10 in 4 s, two a second of four bytes each
LOOKS = 2  # chosen: a link that loses packets may delay one answer; a deaf link is replaced 6 to 10 s after it began


class Links:
    """Watches the links of a session. Make it inside a running event loop, and close it before the session.

    Args:
        is_hub: True if the session is the hub itself, which declares the token that its clients look for.
    """

    def __init__(self, session: zenoh.Session, *, is_hub: bool = False) -> None:
        self._session, self._loop = session, asyncio.get_running_loop()
        self._next_look: dict[int, asyncio.TimerHandle] = {}
        self._looks = not is_hub
        self._answer_within_s = ANSWER_WITHIN_S  # doubles with each replaced link, because a slow link is not deaf
        self._token = session.liveliness().declare_token(KEY_OF_HUB) if is_hub else None
        changed = zenoh.handlers.Callback(self._changed, indirect=False)
        self._listener = session.info.declare_link_events_listener(changed, history=True)

    def close(self) -> None:
        """Look at no link any more."""
        self._looks = False
        for port in tuple(self._next_look):
            self._forget(port)

    def _changed(self, event: zenoh.LinkEvent) -> None:
        protocol, _, local = event.link.src.partition("/")
        if protocol != "tcp":
            return
        is_up = event.kind == zenoh.SampleKind.PUT
        if is_up:
            set_options()
        self._call_soon(self._look_later if is_up else self._forget, int(local.rpartition(":")[2]))

    def _call_soon(self, act: Callable[..., None], *arguments: object) -> None:
        with suppress(RuntimeError):  # the loop is closed
            self._loop.call_soon_threadsafe(act, *arguments)

    def _look_later(self, port: int, looks: int = LOOKS) -> None:
        if self._looks:
            self._next_look[port] = self._loop.call_later(LOOK_EACH_S, self._look, port, looks - 1)

    def _forget(self, port: int) -> None:
        if (look := self._next_look.pop(port, None)) is not None:
            look.cancel()

    def _look(self, port: int, looks_left: int) -> None:
        """Ask the hub for its token; if there is no answer, ask again or end the connection."""
        found: list[zenoh.Reply] = []
        most_bytes = received_bytes(port) + KEEP_ALIVES_BYTES

        def ended() -> None:
            if any(reply.ok for reply in found):  # the end of the time is a reply, too
                self._answer_within_s = ANSWER_WITHIN_S
            else:
                self._call_soon(self._found_nothing, port, looks_left, most_bytes)

        answers = zenoh.handlers.Callback(found.append, ended, indirect=False)
        self._session.liveliness().get(KEY_OF_HUB, answers, timeout=self._answer_within_s)

    def _found_nothing(self, port: int, looks_left: int, most_bytes: int) -> None:
        """Look again or end the connection, unless more bytes came than a deaf link passes, ``most_bytes``."""
        if port not in self._next_look:  # this connection has ended
            return
        if received_bytes(port) > most_bytes:
            return
        if looks_left:
            self._look_later(port, looks_left)
        else:
            log.warning("the link from port %d to the hub passes no messages, so it is made anew", port)
            self._answer_within_s = min(2 * self._answer_within_s, SLOWEST_ANSWER_S)
            shut_down(port)
