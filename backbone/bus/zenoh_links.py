"""Links of a session: those over TCP have our options, and a client's link without messages is replaced.

A new connection of zenoh 1.10 may be *deaf*: it stays up and keeps itself alive, but passes no message to the client,
or none from it, for ever. That happens if the time of its handshake ends while zenoh reports the connection, which a
loss of packets, a cut cable or a paused process can cause (docs/decisions/0003-zenoh-settings.md).

- The hub declares a token, which a client finds over every other connection. If a client does not find it, this file
  ends the connection. One over which more than keep-alives came is not deaf: the answer waits behind other messages.
- A client has one connection at a time, each a transport of its own. If one appears without, zenoh continues the
  transport of an earlier one with it, but the hub knows nothing of what the client declared. This file ends both.

Then the session connects again by itself.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from contextlib import suppress
from typing import NamedTuple

import zenoh

from backbone.authentication import SOCKET
from backbone.bus.sockets import received_bytes, set_options, shut_down
from backbone.bus.zenoh_settings import HOST_LEASE_MS
from backbone.keys import KEY_OF_HUB

log = logging.getLogger(__name__)

LOOK_EACH_S = 1.0  # chosen: the hub's token is known milliseconds after a connection, on a busy machine within 1 s
ANSWER_WITHIN_S = 2.0  # chosen: a link without any message for this time counts as cut
SLOWEST_ANSWER_S = 4.0  # chosen: with such a round trip no command arrives in time
KEEP_ALIVES_BYTES = 512  # chosen: many times the keep-alives of zenoh 1.10 in 4 s, two a second of four bytes each
LOOKS = 2  # chosen: a link that loses packets may delay one answer; a deaf link is replaced 6 to 10 s after it began
OPTIONS_EACH_S = 0.25  # chosen: an attempt to connect lasts up to 2 s, and then its close must not block


class Ends(NamedTuple):
    """Ends of a link, as zenoh names them."""

    local: str
    peer: str


class Links:
    """Watches the links of a session. Make it inside a running event loop, and close it before the session.

    Args:
        is_hub: True if the session is the hub itself, which declares the token that its clients look for.
    """

    def __init__(self, session: zenoh.Session, *, is_hub: bool = False) -> None:
        self._session, self._loop = session, asyncio.get_running_loop()
        self._next_look: dict[Ends, asyncio.TimerHandle] = {}
        """Of each link of a client that is up."""
        self._next_options: asyncio.TimerHandle | None = None
        self._looks, self._is_inside = not is_hub, False
        self._is_new_transport = False
        self._answer_within_s = ANSWER_WITHIN_S  # doubles with each replaced link, because a slow link is not deaf
        self._token = session.liveliness().declare_token(KEY_OF_HUB) if is_hub else None
        # A report lasts as long as its callback, and the time of a handshake goes on: a hub's waits for no Python.
        changed = zenoh.handlers.Callback(self._changed, indirect=is_hub)
        if not is_hub:  # zenoh reports a transport before its first link
            transport_changed = zenoh.handlers.Callback(self._transport_changed, indirect=False)
            session.info.declare_transport_events_listener(transport_changed, history=True)
        session.info.declare_link_events_listener(changed, history=True)

    def close(self) -> None:
        """Look at no link any more."""
        self._looks = False
        for ends in tuple(self._next_look):
            self._forget(ends)
        self._stop_options()

    def _changed(self, event: zenoh.LinkEvent) -> None:
        continues_another = False
        if event.kind == zenoh.SampleKind.PUT:
            if not event.link.dst.startswith(SOCKET):
                set_options()
            continues_another, self._is_new_transport = not self._is_new_transport, False
        self._call_soon(self._follow, continues_another)

    def _transport_changed(self, event: zenoh.TransportEvent) -> None:
        if event.kind == zenoh.SampleKind.PUT:
            self._is_new_transport = True
        else:  # of a link that its sender gave up, no end is reported
            self._call_soon(self._follow, False)

    def _call_soon(self, act: Callable[..., None], *arguments: object) -> None:
        if self._looks:
            with suppress(RuntimeError):  # the loop is closed
                self._loop.call_soon_threadsafe(act, *arguments)

    def _follow(self, continues_another: bool) -> None:
        """Look at the links that are up now. Reports only say that some changed; one may come late or never.

        Args:
            continues_another: A link came up without a transport of its own. The other link may have ended already.
        """
        if not self._looks:
            return
        links = {Ends(link.src, link.dst) for link in self._session.info.links()}
        for ends in self._next_look.keys() - links:
            self._forget(ends)
        for ends in links - self._next_look.keys():
            self._is_inside = ends.peer.startswith(SOCKET)
            self._look_later(ends)
        if continues_another:
            log.warning("a link to the hub continues an earlier one, which the hub has forgotten, so it is made anew")
            for ends in links:
                shut_down(*ends)
        self._stop_options()
        if not links and not self._is_inside:
            self._set_options_repeatedly()

    def _set_options_repeatedly(self) -> None:
        """Let no attempt to connect block when it is given up, until a link is up."""
        set_options()
        self._next_options = self._loop.call_later(OPTIONS_EACH_S, self._set_options_repeatedly)

    def _stop_options(self) -> None:
        if self._next_options is not None:
            self._next_options.cancel()

    def _look_later(self, ends: Ends, looks: int = LOOKS) -> None:
        if self._looks:
            self._next_look[ends] = self._loop.call_later(LOOK_EACH_S, self._look, ends, looks - 1)

    def _forget(self, ends: Ends) -> None:
        if (look := self._next_look.pop(ends, None)) is not None:
            look.cancel()

    def _look(self, ends: Ends, looks_left: int) -> None:
        """Ask the hub for its token; if there is no answer, ask again or end the connection."""
        found: list[zenoh.Reply] = []
        most_bytes = received_bytes(*ends) + KEEP_ALIVES_BYTES

        def ended() -> None:
            if any(reply.ok for reply in found):  # the end of the time is a reply, too
                self._answer_within_s = ANSWER_WITHIN_S
            else:
                self._call_soon(self._found_nothing, ends, looks_left, most_bytes)

        answers = zenoh.handlers.Callback(found.append, ended, indirect=False)
        within_s = HOST_LEASE_MS / 1000 if self._is_inside else self._answer_within_s
        self._session.liveliness().get(KEY_OF_HUB, answers, timeout=within_s)

    def _found_nothing(self, ends: Ends, looks_left: int, most_bytes: int) -> None:
        """Look again or end the connection, unless more bytes came than a deaf link passes, ``most_bytes``."""
        if ends not in self._next_look:  # this connection has ended
            return
        if received_bytes(*ends) > most_bytes:
            return
        if looks_left:
            self._look_later(ends, looks_left)
        else:
            log.warning("the link %s to the hub passes no messages, so it is made anew", ends.local)
            self._answer_within_s = min(2 * self._answer_within_s, SLOWEST_ANSWER_S)
            shut_down(*ends)
