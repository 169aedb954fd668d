"""Presence: when components were present, as a recorder observed it."""

from __future__ import annotations

from backbone.wire import Message


class Presence(Message, frozen=True):
    """A component was ready, or was gone: its liveliness token rose or fell. The recorder wrote it."""

    alive: bool
