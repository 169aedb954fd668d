"""Presence: when components were there, as a recording has it."""

from __future__ import annotations

from backbone.wire import Message


class Presence(Message, frozen=True):
    """A component was ready, or was gone: its liveliness token rose or fell. The recorder wrote it."""

    alive: bool
