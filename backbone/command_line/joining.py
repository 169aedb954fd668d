"""Carries out ``scout-backbone record join``, and prints which clocks were off."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

from backbone.command_line.opened_recording import opened
from backbone.command_line.unusable_file import new_file
from backbone.launcher.endings import ExitCode, say
from backbone.recording.clock_offsets import ClockOffsets, Offset
from backbone.recording.joining import join
from backbone.spoken import counted
from backbone.wire import plain


async def join_to(paths: Sequence[Path], to: Path) -> ExitCode:
    """Write the messages of several recordings of one mission to a new file, and print which clocks were off.

    Raises:
        FileUnusable: A recording cannot be read, or the new file exists or cannot be written.
        NoRecording: A recording is damaged, or its recorder was killed.
        OtherMission: The recordings are of different missions or starts.
    """
    with ExitStack() as stack:
        recordings = [stack.enter_context(opened(path)) for path in paths]
        file = stack.enter_context(new_file(to))
        joined = join(recordings, file)
    copies = f"; {joined.left_out} that several recorders heard stand once" if joined.left_out else ""
    say(f"{to}: {counted(joined.messages, 'message')}{copies}")
    for line in clock_lines(joined.clocks):
        say(f"{line}; corrected in {to.name}")
    return ExitCode.DONE


def clock_lines(clocks: ClockOffsets) -> Iterator[str]:
    """Yield a line for each clock that was wrong according to the causes of messages."""
    for host, offset in clocks.wrong.items():
        told = f"the clock of {host} was {_how_far(offset)} that of {clocks.reference}"
        yield f"{told}, and changed by at least {offset.moved_s:.4f} s" if offset.moved_s else told


def _how_far(offset: Offset) -> str:
    """Return how far a clock was off.

    Example:
        >>> _how_far(Offset(1.5, 2.5, 2.0)), _how_far(Offset(-2.5, -1.5, -2.0)), _how_far(Offset(-math.inf, -1.0, -1.0))
        ('1.5000 to 2.5000 s ahead of', '1.5000 to 2.5000 s behind', 'at least 1.0000 s behind')
        >>> _how_far(Offset(-math.inf, math.inf, 0.002)), _how_far(Offset(-0.5, 0.5, 0.0, moved_s=1.0))
        ('about 0.0020 s ahead of', 'right on average with')
    """
    least_s, most_s = offset.at_least_s, offset.at_most_s
    side = "ahead of" if offset.taken_s > 0 else "behind"
    if least_s <= 0 <= most_s:  # other clocks that causes bind to this one leave no room for 0
        return f"about {abs(offset.taken_s):.4f} s {side}" if offset.taken_s else "right on average with"
    nearest_s, farthest_s = sorted((abs(least_s), abs(most_s)))
    if math.isinf(farthest_s):
        return f"at least {nearest_s:.4f} s {side}"
    return f"{nearest_s:.4f} to {farthest_s:.4f} s {side}"


def clocks_json(clocks: ClockOffsets) -> dict[str, dict[str, float | None]]:
    """Return the bounds of each clock except the reference's; None: no cause bounds it on that side."""
    return {
        host: {name: finite(seconds) for name, seconds in plain(offset).items()}
        for host, offset in clocks.offsets.items()
    }


def finite(value: float) -> float | None:
    """Return the number, or None in the place of one that JSON cannot represent."""
    return value if math.isfinite(value) else None
