"""Screen of an experiment: tables and a progress bar for the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from statistics import median

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from mission_control.laboratory.experiments.conditions import PUBLISHED
from mission_control.laboratory.experiments.intervals import wilson
from mission_control.laboratory.experiments.servoing import ServoOutcome, ServoTrial
from mission_control.laboratory.experiments.surveillance import ConditionRow, SurveillanceOutcome, trials_line
from mission_control.laboratory.harness import Progress as OnProgress

AGREES_WITHIN = 3.0
"""Standard errors between rate and prediction that do not count as disagreement."""
EXPLAINED = (
    "95 %: Wilson's interval. off by: standard errors between rate and prediction; beyond "
    f"{AGREES_WITHIN:g} (marked !) one of both is wrong, or the trials are too few: take more, or another seed."
)
BANDS_DEG = (15.0, 30.0, 45.0)
"""Starts off the zero-angle line, in rows of the table."""


def table(outcome: SurveillanceOutcome, title: str) -> Table:
    """Return the rows as a table: counted rates, predictions and the papers' results."""
    headline = f"{title}: {trials_line(outcome)}"
    found = Table(title=headline, title_justify="left", caption=EXPLAINED, caption_justify="left")
    for heading in ("condition", "policy"):
        found.add_column(heading)
    for heading in (
        "detected",
        "rate",
        "95 %",
        "predicted",
        "off by",
        "paper",
        "paper's 95 %",
        "false alarms",
        "sound",
    ):
        found.add_column(heading, justify="right")
    for row in outcome.rows:
        found.add_row(*_cells(row))
    return found


def summary(outcome: SurveillanceOutcome) -> str:
    """Return the duration and the agreement of grants and transmitters, one line."""
    switches = sum(row.switches for row in outcome.rows)
    wrong = sum(len(row.disagreements) for row in outcome.rows)
    jammed = sum(row.jammed_frames for row in outcome.rows)
    stale = sum(row.stale_packets for row in outcome.rows)
    speed = outcome.simulated_s / outcome.wall_s if outcome.wall_s else 0.0
    return (
        f"{outcome.simulated_s:.0f} s simulated in {outcome.wall_s:.0f} s ({speed:.0f} times real time), seed "
        f"{outcome.seed}; grants and transmitters compared at {switches} switches: {wrong} disagreements, "
        f"{jammed} frames with two transmitters, {stale} packets of past grants"
    )


@contextmanager
def progress_bar(console: Console, what: str) -> Iterator[OnProgress]:
    """Yield a callback for progress; the terminal shows the progress until the end of the block."""
    columns = (TextColumn(what), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, of: bar.update(task, completed=done, total=of)


def _cells(row: ConditionRow) -> list[str]:
    given = PUBLISHED.get(row.condition)
    paper, paper95 = "", ""
    if given is not None:
        paper = given.said
        paper95 = _interval(wilson(given.detected, given.trials)) if given.trials else "-"
    off = row.errors_from_predicted
    return [
        row.condition.title(),
        row.condition.policy,
        f"{row.detected}/{row.trials}",
        f"{row.rate:.1%}",
        _interval(row.interval95),
        f"{row.predicted:.1%}",
        f"{off:+.1f} s.e.{' !' if abs(off) > AGREES_WITHIN else ''}",
        paper,
        paper95,
        str(row.false_alarms),
        "yes" if row.is_sound else "NO",
    ]


def _interval(bounds: tuple[float, float]) -> str:
    return f"{bounds[0]:.0%} - {bounds[1]:.0%}"


def servo_table(outcome: ServoOutcome) -> Table:
    """Return the trials grouped by their angle off the line, and all together."""
    found = Table(title=f"Servoing: 5 cm and 10°, noise {outcome.noise:g}, seed {outcome.seed}", title_justify="left")
    found.add_column("off the line")
    for heading in ("arrived", "rate", "95 %", "median time", "median off", "approached again"):
        found.add_column(heading, justify="right")
    least_deg = 0.0
    for most_deg in BANDS_DEG:
        among = [t for t in outcome.trials if least_deg <= abs(t.off_axis_deg) < most_deg]
        found.add_row(f"{least_deg:.0f} to {most_deg:.0f}°", *_servo_cells(among))
        least_deg = most_deg
    found.add_section()
    found.add_row("all", *_servo_cells(list(outcome.trials)))
    return found


def _servo_cells(trials: list[ServoTrial]) -> list[str]:
    if not trials:
        return ["0/0", "", "", "", "", ""]
    arrived = sum(trial.succeeded for trial in trials)
    low, high = wilson(arrived, len(trials))
    return [
        f"{arrived}/{len(trials)}",
        f"{arrived / len(trials):.1%}",
        f"{low:.0%} to {high:.0%}",
        f"{median(trial.took_s for trial in trials):.0f} s",
        f"{median(trial.off_m for trial in trials) * 100:.1f} cm",
        f"{sum(trial.approaches > 1 for trial in trials)}",
    ]
