"""The schedule trace: lines with which an independent judge can replay every decision.

``TraceWriter`` writes them. Times are mission seconds, written with all digits, so that a replay gets exactly the same
decision times.
"""

from __future__ import annotations

from typing import Any

Line = dict[str, Any]
"""Kind of the line (``ev``), its time (``t``), and the fields of this kind, as the trace format fixes them."""

VERSION = 1
EXCLUSIVE = "x"
