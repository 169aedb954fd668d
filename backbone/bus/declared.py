"""Declarations of a bus on a session, which it can withdraw, and answers that it waits for."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from backbone.bus.inbox import InboxBus, Receiving
from backbone.waiting import settle


class Declaration:
    """A zenoh entity that can be withdrawn once; None if no entity was needed.

    Attributes:
        receiver: Receiver of the samples of a subscription to one conversation; None: another declaration.
    """

    def __init__(self, entity: Any, register: set[Declaration], receiver: Receiving | None = None) -> None:
        self._entity, self._register, self.receiver = entity, register, receiver

    @property
    def stands(self) -> bool:
        """True until it is withdrawn."""
        return self in self._register

    def close(self) -> None:
        """Withdraw the declaration."""
        if self.stands:
            self._register.remove(self)
            if self._entity is not None:
                self._entity.undeclare()


class Withdrawal:
    """A declaration that a function withdraws."""

    def __init__(self, withdraw: Callable[[], object]) -> None:
        self._withdraw = withdraw

    def undeclare(self) -> None:
        """Withdraw the declaration. Call it only once."""
        self._withdraw()


class Together:
    """Entities that are withdrawn together; None: an entity that was not needed."""

    def __init__(self, *entities: Any) -> None:
        self._entities = entities

    def undeclare(self) -> None:
        """Withdraw all."""
        for entity in self._entities:
            if entity is not None:
                entity.undeclare()


class FirstReply:
    """Passes a question's first reply to the loop, or None if there was none."""

    __slots__ = ("_answered", "_bus", "_replied")

    def __init__(self, bus: InboxBus, answered: asyncio.Future[Any]) -> None:
        self._bus, self._answered, self._replied = bus, answered, False

    def reply(self, got: Any) -> None:
        """Pass an answer to the loop; called from another thread."""
        self._replied = True  # exactly one component answers, so the end that follows adds nothing
        self._bus.push(self._settle, got)

    def end(self) -> None:
        """Pass None to the loop if there was no answer; called from another thread after the last answer."""
        if not self._replied:
            self._bus.push(self._settle, None)

    def _settle(self, got: Any) -> None:
        settle(self._answered, got)
