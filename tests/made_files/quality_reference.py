"""The table of qualities in the reference page of messages, made of their declaration."""

from __future__ import annotations

from backbone.keys import Conversation
from backbone.quality import QUALITY

_HEAD = "| conversation | quality | most bytes | on its host |"


def quality_reference(page: str) -> str:
    """Return the page with the table of qualities made anew; all else stays."""
    before, _, rest = page.partition(_HEAD)
    after = rest.partition("\n\n")[2]
    rows = [_row(one) for one in QUALITY if one is not Conversation.ALIVE]
    return "\n".join([before + _HEAD, "|---|---|---|---|", *rows]) + "\n\n" + after


def _row(conversation: Conversation) -> str:
    quality = QUALITY[conversation]
    on_host = _size(quality.most_bytes_on_host) if quality.most_bytes_on_host else "–"
    return f"| `{conversation}` | {quality} | {_size(quality.most_bytes)} | {on_host} |"


def _size(count: int) -> str:
    """Return a size in the unit that makes it short.

    Example:
        >>> _size(64 * 1024), _size(8 * 1024 * 1024)
        ('64 KiB', '8 MiB')
    """
    return f"{count // 1024**2} MiB" if count >= 1024**2 else f"{count // 1024} KiB"
