"""Missing answers: blocks of questions that end, without an error, at a refusal or at a missing answer."""

from __future__ import annotations

import logging
from collections.abc import Callable
from types import TracebackType

from backbone.errors import LinkError, Refusal

log = logging.getLogger(__name__)


class Answered:
    """Ends its block at a refusal or a missing answer.

    Args:
        failed: Called with it.
    """

    def __init__(self, failed: Callable[[Refusal | LinkError], None]) -> None:
        self._failed = failed

    def __enter__(self) -> None:
        """Begin."""

    def __exit__(
        self, _kind: type[BaseException] | None, error: BaseException | None, _at: TracebackType | None
    ) -> bool:
        """Suppress the error with which ``failed`` was called, and no other."""
        if isinstance(error, Refusal | LinkError):
            self._failed(error)
            return True
        return False


def quietly(name: str, what: str) -> Answered:
    """Return a block that continues without the answer; a log message says who did not answer, and what."""
    return Answered(lambda error: log.info("%s %s: %s", name, what, error))
