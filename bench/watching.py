"""Cost of watchers for a person who drives: a hundred commands a second, while others attach, watch all, and leave.

Brings the mission of IROS 2001 up, takes its third Scout as a console does, and turns it by a command every 10 ms.
Parts of three kinds take turns:

* ``watched``: a process attaches to the mission, watches all keys as ``scout-backbone watch`` does, and leaves, several
  times. It is one process, so no interpreter starts meanwhile.
* ``floor``: that process waits for as long.
* ``busy``: it uses as much of a core for as long, without a mission: the cost of a watcher merely on this machine.

``applied`` is the time from the wish, or from its due time if the command before was late, until the robot's RC had
applied it; ``answered`` until the console knew. Prints one JSON line. Ratios are of ``applied``, with watchers over the
floor. ``ratio_p99_of_parts`` uses the median parts, so that other work of the machine counts less;
``ratio_p99_of_busy_parts`` is the same over ``busy``: the mission's own work for watchers.

With ``--cycles 1 --seconds 10`` a watcher stays for its part: the cost of watching without attaching and leaving.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass, field
from statistics import median

import uvloop
from measuring import MISSION_XML, percentile, report, summary
from missions import mission_up

from backbone.command_line.watching import Watched, watch
from backbone.command_line.where import Where
from backbone.operating_system.own_process import go_behind_others
from backbone.recording.known_messages import message_classes
from ui_console.model.driving import MoveWish
from ui_console.model.events import CommandApplied, ConsoleEvent
from ui_console.session.joining import join
from ui_console.session.teleoperation import Teleoperation

MISSION = "iros2001"
WHERE = Where(MISSION, None, None)
CLAIM = {"robot": "scout3", "kind": "drive", "priority": 100}
TURN = MoveWish(forward_m_s=0.0, turn_rad_s=0.3)  # chosen: the robot stays where it is
PERIOD_S = 0.01  # a command loop of 100 Hz
WATCHES_S = 0.2  # chosen: as long as a person needs to see that messages come
SETTLE_S = 1.0  # chosen: the effects of a part end before the next
KINDS = ("watched", "floor", "busy")
TURNS = (*KINDS, "watched", "busy", "floor")
"""Each kind follows both others; the first is watched, because the others last as long as it."""


@dataclass
class Times:
    """Seconds of each command in the parts of one kind.

    Attributes:
        late_s: For each part, the time until applied that 99 % of its commands do not exceed.
    """

    applied_s: list[float] = field(default_factory=list)
    answered_s: list[float] = field(default_factory=list)
    late_s: list[float] = field(default_factory=list)
    failed: int = 0


class Driver:
    """Turns the robot by a command every ``PERIOD_S``.

    Attributes:
        times: Times of each kind of part.
        shown: Number of messages that watchers showed.
    """

    def __init__(self) -> None:
        self.times: dict[str, Times] = defaultdict(Times)
        self.shown = 0
        self._applied_s = 0.0

    def heard(self, event: ConsoleEvent) -> None:
        """Record when the RC applied a command."""
        if isinstance(event, CommandApplied):
            self._applied_s = event.at_s

    async def drive(self, console: Teleoperation, part: asyncio.Task[bytes], times: Times) -> None:
        """Command until the part is over; mission times equal those of the machine."""
        clock, due_s, before = console.clock, console.clock.now_s(), len(times.applied_s)
        while not part.done():
            due_s += PERIOD_S
            began_s = due_s
            if clock.now_s() < due_s:
                await clock.sleep_until_s(due_s)
                began_s = clock.now_s()
            if await console.do(TURN):
                times.applied_s.append(self._applied_s - began_s)
                times.answered_s.append(clock.now_s() - began_s)
            else:
                times.failed += 1
        times.late_s.append(percentile(times.applied_s[before:], 0.99))
        self.shown += int(part.result())


def be_watcher(cycles: int, seconds: float) -> None:
    """Run a part for each line of the input, which names its kind; print how many messages were shown."""
    go_behind_others()  # as the command does
    message_classes()  # read once, not at each attaching
    lasted_s = used_s = 0.0
    for line in sys.stdin:
        began_s, used_before_s, shown = time.monotonic(), time.process_time(), 0
        if line.strip() == "watched":
            with tempfile.TemporaryFile("w+") as lines, contextlib.redirect_stdout(lines):  # a terminal costs more
                for _ in range(cycles):
                    uvloop.run(watch(WHERE, Watched((), for_s=seconds)))
                lines.seek(0)
                shown = sum(1 for _ in lines)
            lasted_s, used_s = time.monotonic() - began_s, time.process_time() - used_before_s
        else:
            for cycle in range(1, cycles + 1):
                while line.strip() == "busy" and time.process_time() - used_before_s < used_s * cycle / cycles:
                    pass
                time.sleep(max(0.0, began_s + lasted_s * cycle / cycles - time.monotonic()))
        print(shown, flush=True)


async def measure(given: argparse.Namespace) -> Driver:
    """Drive in parts of all kinds; return the driver."""
    driver = Driver()
    words = ["--watcher", "--cycles", str(given.cycles), "--seconds", str(given.seconds)]
    watcher = await asyncio.create_subprocess_exec(
        sys.executable, __file__, *words, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    orders, answers = watcher.stdin, watcher.stdout
    assert orders is not None
    assert answers is not None

    async def work(console: Teleoperation) -> None:
        await console.wait_granted()
        for number in range(len(KINDS) * given.rounds):
            kind = TURNS[number % len(TURNS)]
            await console.clock.sleep_s(SETTLE_S)
            orders.write(f"{kind}\n".encode())
            await driver.drive(console, asyncio.create_task(answers.readline()), driver.times[kind])

    joining = await join(WHERE, dict(CLAIM))
    bus = await joining.open_bus()
    await Teleoperation(joining.launch, bus, joining.clock, show=driver.heard, work=work, watches=False).run()
    orders.close()
    await watcher.wait()
    return driver


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--watcher", action="store_true", help="be the process that attaches, watches and leaves")
    parser.add_argument("--rounds", type=int, default=10, help="parts of each kind")
    parser.add_argument("--cycles", type=int, default=5, help="watchers in a part, one after the other")
    parser.add_argument("--seconds", type=float, default=WATCHES_S, help="how long each of them watches")
    given = parser.parse_args()
    if given.watcher:
        be_watcher(given.cycles, given.seconds)
        return
    with mission_up(MISSION_XML, name=MISSION):
        driver = uvloop.run(measure(given))
    kinds = [(kind, driver.times[kind]) for kind in KINDS]
    half, late = ({kind: percentile(times.applied_s, share) for kind, times in kinds} for share in (0.5, 0.99))
    of_parts = {kind: median(times.late_s) for kind, times in kinds}
    report(
        "watching",
        attached=given.rounds * given.cycles,
        messages_shown=driver.shown,
        commands={kind: len(times.applied_s) for kind, times in kinds},
        failed={kind: times.failed for kind, times in kinds},
        applied={kind: summary(times.applied_s) for kind, times in kinds},
        answered={kind: summary(times.answered_s) for kind, times in kinds},
        ratio=round(half["watched"] / half["floor"], 3),
        ratio_p99=round(late["watched"] / late["floor"], 3),
        ratio_p99_of_parts=round(of_parts["watched"] / of_parts["floor"], 3),
        ratio_p99_of_busy_parts=round(of_parts["watched"] / of_parts["busy"], 3),
        aim_p99=1.05,
    )


if __name__ == "__main__":
    main()
