"""Authentication and decoding of clients: bytes and a time go in, a typed intent or a typed violation comes out.

Rules of this file: no socket, no bus, no clock; times are seconds of the machine, which never run backwards.

* A client that is not authenticated can only send its token, and must do so within ``LOGIN_WITHIN_S``.
* After a fatal violation every further message of the client is ignored.
* A client that exceeds ``RATE_HZ`` by more than ``BURST`` messages violates the protocol; no client's messages delay
  another's.
"""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Generic, TypeVar

import msgspec

MAX_MESSAGE_BYTES = 4096  # chosen: ten times a parameter's value
LOGIN_WITHIN_S = 5.0  # chosen: a page sends its token as soon as it is connected
RATE_HZ = 200.0  # chosen: 20 drives a second and 30 drawn pictures a second of each of four robots use two thirds
BURST = 200.0  # chosen: the messages of a page after a pause of a second
FAULTS_FORGIVEN = 5  # chosen: an old page in a browser's cache must reload, and keeps its connection meanwhile
TOKEN_BYTES = 24  # chosen: 192 bits cannot be guessed

MAX_USER = 63  # as long as a component's name
SHOWN_OF_PAGE = 4  # chosen: hexadecimal digits that tell a team's nameless pages apart
ShortText = Annotated[str, msgspec.Meta(max_length=MAX_USER)]
IntentT = TypeVar("IntentT")
"""The intents of one kind of page."""


class Hello(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="hello"):
    """The first message: token and identity.

    Attributes:
        token: Token that the server printed at its start.
        user: Name of the person, for the record; the name of an operator's own token takes precedence. Each page
            without a name is a person of its own.
        priority: Requested priority; the token's priority is the maximum.
        page: Identifies a page that reconnects; an earlier connection of the same page is closed.
    """

    token: Annotated[str, msgspec.Meta(max_length=256)]
    user: ShortText = ""
    priority: int | None = None
    page: ShortText = ""


class BeatRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="beat"):
    """Ask for this number back: the answer shows the page that the server receives it, and the content's age."""

    number: Annotated[int, msgspec.Meta(ge=0, le=2**53)]


class ViolationKind(StrEnum):
    """Kinds of violations."""

    TOKEN = "token"  # noqa: S105  the word, not a token
    LATE = "late"  # no token in time
    OVERSIZED = "oversized"
    MALFORMED = "malformed"
    FLOOD = "flood"
    SLOW = "slow"  # the client does not read its messages
    CROWD = "crowd"  # too many clients
    ORIGIN = "origin"  # a page of another site


@dataclass(frozen=True, slots=True)
class ProtocolViolation:
    """A message, or a silence, that breaks the protocol.

    Attributes:
        kind: Its kind.
        line: The event, for people; without text from the client.
        remedy: An action against it.
        is_fatal: True: the connection must end.
    """

    kind: ViolationKind
    line: str
    remedy: str
    is_fatal: bool = True


@dataclass(frozen=True, slots=True)
class Welcome:
    """The token was correct.

    Attributes:
        user: Name of the person.
        priority: Priority of this client's claims.
        page: As in ``Hello``.
    """

    user: str
    priority: int
    page: str = ""


@dataclass(frozen=True, slots=True)
class TokenRights:
    """The rights of a token.

    Attributes:
        user: Its operator; empty: ``Hello`` states a name.
        priority: The highest priority of a claim.
    """

    user: str
    priority: int


class Authenticator:
    """Knows the tokens."""

    def __init__(self, rights: Mapping[str, TokenRights]) -> None:
        self._rights = {token.encode(): granted for token, granted in rights.items()}

    def rights_of(self, token: str) -> TokenRights | None:
        """Return the rights of the token, None for a wrong one; the time depends only on the token's length."""
        found = None
        for known, granted in self._rights.items():
            if hmac.compare_digest(known, token.encode("utf-8", "surrogatepass")):
                found = granted
        return found


def new_token() -> str:
    """Return a token that cannot be guessed."""
    return secrets.token_urlsafe(TOKEN_BYTES)


def new_rights(operators: Iterable[tuple[str, int]], priority: int) -> dict[str, TokenRights]:
    """Return new tokens: one for each operator with an own priority, or one for all.

    Raises:
        WrongOperator: Two operators have one name.
    """
    named = [TokenRights(user, own) for user, own in operators]
    users = [granted.user for granted in named]
    if twice := next((user for user in users if users.count(user) > 1), None):
        raise WrongOperator(f"{twice} is there twice; give each operator a name of their own")
    return {new_token(): granted for granted in named or [TokenRights("", priority)]}


class WrongOperator(ValueError):
    """An operator is not written as ``NAME=PRIORITY``, or has the name of another one."""


def read_operator(text: str) -> tuple[str, int]:
    """Return an operator's name and priority.

    Raises:
        WrongOperator: It is not ``NAME=PRIORITY``, with a printable name that neither begins nor ends with a space, and
            a whole number from 0 of at most nine digits.

    Example:
        >>> read_operator("anna=120")
        ('anna', 120)
    """
    user, _equals, priority = text.rpartition("=")
    is_name = 0 < len(user) <= MAX_USER and user.isprintable() and user == user.strip()
    if not is_name or not (priority.isdecimal() and len(priority) < 10):
        raise WrongOperator(f"{text!r} is not NAME=PRIORITY, such as anna=120")
    return user, int(priority)


class ClientSession(Generic[IntentT]):
    """A connection, from the first byte on.

    Args:
        authenticator: Knows the tokens.
        understand: Decodes a message; raises ``msgspec.DecodeError`` for an invalid one.
        now_s: Time of the connection.
    """

    def __init__(
        self,
        authenticator: Authenticator,
        understand: Callable[[bytes | str], Hello | BeatRequest | IntentT],
        now_s: float,
    ) -> None:
        self._understand = understand
        self._authenticator, self._came_s = authenticator, now_s
        self._room, self._room_at_s = BURST, now_s
        self._faults = 0
        self.welcome: Welcome | None = None
        """None until the token was accepted."""
        self.is_out = False
        """True after a fatal violation."""

    @property
    def must_log_in_by_s(self) -> float | None:
        """Deadline of the token; None: the token has arrived."""
        return None if self.welcome is not None else self._came_s + LOGIN_WITHIN_S

    def heard(self, data: str | bytes, now_s: float) -> Welcome | BeatRequest | IntentT | ProtocolViolation | None:
        """Return the decoded message; None after a fatal violation.

        Args:
            data: The received message.
            now_s: Time of its arrival.
        """
        if self.is_out:
            return None
        if not self._has_room(now_s):
            return self._out(ViolationKind.FLOOD, f"sent more than {RATE_HZ:.0f} messages a second", "Reload the page.")
        if len(data) > MAX_MESSAGE_BYTES:
            return self.oversized()
        try:
            said = self._understand(data)
        except (msgspec.DecodeError, UnicodeError, RecursionError):
            return self._malformed()
        if isinstance(said, Hello):
            return self._log_in(said) if self.welcome is None else self._malformed()
        if self.welcome is None:
            return self._out(
                ViolationKind.TOKEN, "spoke before it showed a token", "Open the address that serve printed."
            )
        return said

    def oversized(self) -> ProtocolViolation:
        """Return the violation of a message that was too long to be read."""
        return self._out(
            ViolationKind.OVERSIZED, f"sent a message of more than {MAX_MESSAGE_BYTES} bytes", "Reload the page."
        )

    def late(self) -> ProtocolViolation:
        """Return the violation of a client without a token at ``must_log_in_by_s``."""
        return self._out(ViolationKind.LATE, f"showed no token within {LOGIN_WITHIN_S:.0f} s", "Load the page again.")

    def slow(self, behind_s: float) -> ProtocolViolation:
        """Return the violation of a client that does not read."""
        line = f"has read nothing for {behind_s:.0f} s"
        return self._out(ViolationKind.SLOW, line, "Come closer to the access point, or show fewer pictures.")

    def _log_in(self, hello: Hello) -> Welcome | ProtocolViolation:
        granted = self._authenticator.rights_of(hello.token)
        if granted is None:
            return self._out(ViolationKind.TOKEN, "showed a wrong token", "Open the address that serve printed.")
        user = granted.user or _one_line(hello.user) or _one_line(f"unnamed {hello.page[:SHOWN_OF_PAGE]}")
        wished = granted.priority if hello.priority is None else hello.priority
        self.welcome = Welcome(user, min(max(wished, 0), granted.priority), hello.page)
        return self.welcome

    def _has_room(self, now_s: float) -> bool:
        self._room = min(BURST, self._room + RATE_HZ * (now_s - self._room_at_s))
        self._room_at_s = now_s
        if self._room < 1.0:
            return False
        self._room -= 1.0
        return True

    def _malformed(self) -> ProtocolViolation:
        self._faults += 1
        line = "sent a message that means nothing"
        if self.welcome is None or self._faults > FAULTS_FORGIVEN:
            return self._out(ViolationKind.MALFORMED, line, "Load the page again, without the browser's memory.")
        return ProtocolViolation(
            ViolationKind.MALFORMED, line, "Load the page again, without the browser's memory.", is_fatal=False
        )

    def _out(self, kind: ViolationKind, line: str, remedy: str) -> ProtocolViolation:
        self.is_out = True
        return ProtocolViolation(kind, line, remedy)


def _one_line(text: str) -> str:
    return " ".join(text.split())
