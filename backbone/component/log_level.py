"""Importance of an event, for messages and for the command line, whose help loads no messages."""

from __future__ import annotations

from enum import StrEnum


class LogLevel(StrEnum):
    """Importance of an event, most important first."""

    ALARM = "alarm"  # a robot may act wrongly, or not at all
    WARNING = "warning"  # the mission continues, degraded
    NOTICE = "notice"  # an action or finding of a person or behavior
    INFO = "info"
