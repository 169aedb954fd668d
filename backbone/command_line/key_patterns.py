"""The patterns of keys that ``watch``, ``top``, ``record`` and ``bridge`` are given. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable

from backbone.errors import Refusal
from backbone.keys import COPIED, ROOT, Conversation
from backbone.naming import Subsystem, did_you_mean

_WILD = re.compile(r"[*?]|\[.+\]")  # the wildcards of fnmatch
_HEARD = [one.value for one in Conversation if one not in {*COPIED, Conversation.ALIVE}]


class ImpossiblePattern(Refusal):
    """No key of the mission can match a pattern."""

    code = "usage.key_pattern"
    remedy = "Write a key as 'top' prints it, with '*' for any text: 'resource_pool/*/readings', '*/scout1/*'."


def check_patterns(patterns: Iterable[str], mission: str) -> None:
    """Raise if a listener to one of these patterns would wait for ever.

    Raises:
        ImpossiblePattern: No key of this mission can match a pattern.
    """
    for pattern in patterns:
        if why := _fault(pattern, mission):
            raise ImpossiblePattern(f"{pattern!r} matches no key: {why}")


def _fault(pattern: str, mission: str) -> str:
    """Return why no key matches, as far as the parts without wildcards show it; empty: a key may match."""
    parts = pattern.split("/")
    first, second, last = parts[0], parts[min(1, len(parts) - 1)], parts[-1]
    roots = [*(one.value for one in Subsystem), ROOT]
    if "" in parts:
        return "it is empty" if pattern == "" else "it has an empty part"
    if _is_literal(last) and last not in _HEARD:
        return f"{last!r} is none of the last parts of keys{did_you_mean(last, _HEARD)}"
    if _is_literal(first) and first not in roots:
        return f"{first!r} is no subsystem{did_you_mean(first, roots)}"
    if first == ROOT and _is_literal(second) and second != mission:
        return f"the mission is {mission}"
    return ""


def _is_literal(part: str) -> bool:
    return _WILD.search(part) is None
