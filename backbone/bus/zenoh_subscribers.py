"""The subscribers of one session: one zenoh subscriber for each pattern of keys, for all listeners of the process.

The members of a shared process listen to the same keys, such as the leases, and each message reaches the process once.
In a client's process, zenoh's receiving thread calls the listeners. In the hub's process each subscriber has a thread,
because a hub that routes must not wait for Python.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import zenoh

from backbone.bus.declared import Withdrawal

Receive = Callable[[zenoh.Sample], None]


class Subscribers:
    """Declares subscribers on a session. Used in the event loop; receivers are called in threads of zenoh.

    Args:
        is_hub: True if the session is the hub itself.
    """

    def __init__(self, session: zenoh.Session, *, is_hub: bool = False) -> None:
        self._session, self._is_hub = session, is_hub
        self._fans: dict[str, _Fan] = {}

    def declare(self, pattern: str, receive: Receive) -> Withdrawal:
        """Call the receiver with each sample of these keys until it is withdrawn."""
        fan = self._fans.get(pattern)
        if fan is None:
            fan = self._fans[pattern] = _Fan()
            each = zenoh.handlers.Callback(fan, indirect=self._is_hub)
            fan.entity = self._session.declare_subscriber(pattern, each)
        fan.receivers = (*fan.receivers, receive)
        return Withdrawal(lambda: self._withdraw(pattern, receive))

    def _withdraw(self, pattern: str, receive: Receive) -> None:
        fan = self._fans[pattern]
        fan.receivers = tuple(one for one in fan.receivers if one is not receive)
        if not fan.receivers:
            del self._fans[pattern]
            fan.entity.undeclare()


class _Fan:
    """The receivers of one subscriber of zenoh. They are replaced as a whole, because another thread reads them."""

    def __init__(self) -> None:
        self.receivers: tuple[Receive, ...] = ()
        self.entity: Any = None

    def __call__(self, sample: zenoh.Sample) -> None:
        for receive in self.receivers:
            receive(sample)
