"""An independent checker of schedule traces, written from the rules and not from the scheduler.

``check(lines)`` replays a trace and returns each violation with the name of the rule that it breaks.
On the command line: ``python -m tests.trace_checker FILE [--tol SECONDS]`` from the top folder.
"""

from .admission import admissible
from .replay import check
from .trace_format import Malformed, read_lines
from .violation import NAMES, Violation

__all__ = ["NAMES", "Malformed", "Violation", "admissible", "check", "read_lines"]
