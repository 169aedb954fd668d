"""The Markdown of the table of stops: a row for each console and link. Pure."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

from measuring import percentile

HEAD = """\
| console | link | cells | stands after: median, worst | says so after: worst | faults |
|---|---|---|---|---|---|"""


def markdown(rows: Iterable[dict[str, Any] | str]) -> str:
    """Return the table of these cells, given as data or as printed lines.

    Example:
        >>> print(markdown([{"console": "pendant", "link": "up", "stands_s": 0.1}]).splitlines()[2])
        | pendant | up | 1 | 0.10 s, 0.10 s | – | 0 |
    """
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for one in rows:
        row = json.loads(one) if isinstance(one, str) else one
        groups.setdefault((row["console"], row["link"]), []).append(row)
    return "\n".join([HEAD, *(_line(console, link, found) for (console, link), found in groups.items())])


def _line(console: str, link: str, found: list[dict[str, Any]]) -> str:
    stands_s = [row["stands_s"] for row in found if "stands_s" in row]
    said_s = [row["said_s"] for row in found if "said_s" in row]
    stands = f"{percentile(stands_s, 0.5):.2f} s, {max(stands_s):.2f} s" if stands_s else "–"
    says = f"{max(said_s):.2f} s" if said_s else "–"
    faults = sum("fault" in row for row in found)
    return f"| {console} | {link} | {len(found)} | {stands} | {says} | {faults} |"
