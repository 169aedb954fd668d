"""Processor time of a simulated trial of the surveillance experiment by part, the RC manager's prediction first.

Every trial runs as in the experiment, in one process on a virtual clock. The parts are timed at their entry points:
``prediction`` is the RC manager's time for expected starts (the published schedule, replies, ``why`` and revoked ARCs),
``decisions`` is the rest of the scheduling core, the others are the simulated world and the watchers' vision; ``rest``
is bus, components and event loop. Prints one JSON line with shares of the processor time, on which other programs of
the machine have little influence.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Callable
from functools import wraps
from typing import Any

from measuring import report

from backbone.scheduling.closing import Closing
from backbone.scheduling.explain.answers import Answers
from backbone.scheduling.schedule_manager import ScheduleManager
from mission_control.laboratory.experiments.conditions import EVERYTHING
from mission_control.laboratory.experiments.surveillance import TrialOrder, run_order
from mission_control.vision.motion_detection import MotionDetector
from scout_model.camera import Camera
from scout_model.video_link import Receiver
from scout_model.world import World

DOORS: list[tuple[str, type[Any], str]] = [
    *(("prediction", Answers, name) for name in ("schedule", "scheduled", "why")),
    ("prediction", Closing, "_expect"),
    ("decisions", ScheduleManager, "handle"),
    ("world", World, "step_frame"),
    ("camera", Camera, "picture"),
    ("receiver", Receiver, "receive"),
    ("detector", MotionDetector, "look"),
]


Spent = Counter[str]
"""Part → processor time, seconds."""


def timed(spent_s: Spent, part: str, of: type[Any], name: str) -> None:
    """Count the processor time of this method from now on, without that of other parts called in it."""
    method: Callable[..., Any] = getattr(of, name)

    @wraps(method)
    def counted(*args: Any, **named: Any) -> Any:
        began_s, before_s = time.process_time(), spent_s.total()
        try:
            return method(*args, **named)
        finally:
            inside_s = spent_s.total() - before_s
            spent_s[part] += time.process_time() - began_s - inside_s

    setattr(of, name, counted)


def main() -> None:
    """Run trials of every condition of the experiment and print the shares."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=2, help="of each condition, above 0")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    if asked.trials < 1:
        parser.error(f"--trials {asked.trials}: at least 1")
    run_order(TrialOrder(EVERYTHING[0], asked.seed, 0, ""))  # imports and compiled worlds are not part of a trial
    spent_s: Spent = Counter()
    for part, of, name in DOORS:
        timed(spent_s, part, of, name)
    began_s = time.process_time()
    simulated_s = sum(
        run_order(TrialOrder(condition, asked.seed, number, "")).simulated_s
        for condition in EVERYTHING
        for number in range(asked.trials)
    )
    all_s = time.process_time() - began_s
    trials = asked.trials * len(EVERYTHING)
    parts = {part: round(spent_s[part] / all_s, 4) for part in dict.fromkeys(part for part, _, _ in DOORS)}
    report(
        "trial",
        trials=trials,
        processor_s_a_trial=round(all_s / trials, 4),
        times_real_time=round(simulated_s / all_s, 1),
        shares={**parts, "rest": round(1.0 - spent_s.total() / all_s, 4)},
    )


if __name__ == "__main__":
    main()
