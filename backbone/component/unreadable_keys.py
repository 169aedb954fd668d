"""Keys whose publications a component cannot read: told once each, because it waits for them without a word."""

from __future__ import annotations

from typing import Protocol

from backbone.component.log_level import LogLevel
from backbone.errors import Refusal

MOST_TOLD = 16  # chosen: more than an honest mission ever has; garbage on thousands of keys fills no log


class Teller(Protocol):
    """A component, as far as this module needs it."""

    @property
    def name(self) -> str:
        """Its name."""

    def publish_event(self, subject: str, what: str, level: LogLevel = LogLevel.INFO) -> None:
        """Add an event to the story, and publish it to the mission's log."""


class UnreadableKeys:
    """Tells each key at its first publication that cannot be read.

    Args:
        component: Whose story has it.
    """

    def __init__(self, component: Teller) -> None:
        self._component = component
        self._told: set[str] = set()

    def tell(self, key: str, refusal: Refusal) -> None:
        """Tell why, unless the key was told."""
        if key not in self._told and len(self._told) < MOST_TOLD:
            self._told.add(key)
            told = f"cannot read {key}: {refusal.detail} (remedy: {refusal.remedy})"
            self._component.publish_event(self._component.name, told, LogLevel.WARNING)
