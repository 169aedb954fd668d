"""A component, as its parts see it: ``Component`` without its life cycle, so that no part imports its component."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Protocol

from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.component.log_level import LogLevel
from backbone.component.story import StoryBook


class ComponentOfParts(Protocol):
    """The interface of a component for its parts; see ``Component``."""

    launch: Launch
    bus: Bus
    clock: Clock
    story: StoryBook

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def address(self) -> str:
        """Its address."""

    def start_task(self, work: Coroutine[object, None, None], name: str) -> asyncio.Task[None]:
        """Run the coroutine until the component ends."""

    def report(self, feedback: str) -> None:
        """Set the feedback."""

    def changed(self) -> None:
        """Note that the published state may have changed."""

    def publish_event(self, subject: str, what: str, level: LogLevel = LogLevel.INFO) -> None:
        """Add an event about the subject to the story, and publish it to the mission's log."""

    def end(self, reason: str) -> None:
        """End in good order."""

    def fail(self, bug: BaseException) -> None:
        """End because of a bug."""
