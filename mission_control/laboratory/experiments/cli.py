"""``scout-backbone experiment``: the papers' experiments on simulated robots."""

from __future__ import annotations

import json
import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from backbone.command_line.options import CommandTable
from backbone.command_line.unusable_file import FileUnusable
from backbone.errors import Refusal, code_of
from backbone.launcher.endings import ExitCode

SHARE_DRIVEN = "Share of the time in which consoles are driven."
app = typer.Typer(
    cls=CommandTable,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    help="Run experiments on simulated robots, among them those of the papers: many trials, faster than real time.",
)

MOST_TRIALS = 1_000_000  # chosen: days of work
LARGEST_SEED = 2**32 - 1  # the limit of numpy
MOST_JOBS = 1024  # chosen: more cores than any tested machine
PIPE_WIDTH = 200  # chosen: wider than every table, so that files and pipes get whole tables


class Policy(StrEnum):
    """Policy of the requests for run time."""

    PAPER = "paper"
    ADAPTIVE = "adaptive"


class TargetKind(StrEnum):
    """Kinds of targets."""

    PIONEER = "pioneer"
    PERSON = "person"


class TurnOrder(StrEnum):
    """Order of the turns of watchers and consoles."""

    ACTIVE_FIRST = "active-first"
    EXTRA_FIRST = "extra-first"
    INTERLEAVED = "interleaved"


Trials = Annotated[int, typer.Option("--trials", min=1, max=MOST_TRIALS, help="Of each condition.")]
Seed = Annotated[int, typer.Option("--seed", min=0, max=LARGEST_SEED, help="The same seed gives the same table.")]
Jobs = Annotated[int, typer.Option("--jobs", min=0, max=MOST_JOBS, help="Processes; 0: one a core.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
PlotTo = Annotated[Path | None, typer.Option("--plot", help="Write a picture of the rates, PNG or SVG.")]
TracesTo = Annotated[Path | None, typer.Option("--traces", help="New folder for the schedule trace of each trial.")]


@app.callback()
def _experiment() -> None:
    """Keep each experiment a command of its own."""


@app.command()
def surveillance(
    active: Annotated[int | None, typer.Option("--active", help="Scouts that watch.")] = None,
    extra: Annotated[list[int] | None, typer.Option("--extra", help="Scouts that consoles hold; repeatable.")] = None,
    channels: Annotated[int | None, typer.Option("--channels", help="Video frequencies.")] = None,
    policy: Annotated[list[Policy] | None, typer.Option("--policy", help="Policy of the requests; repeatable.")] = None,
    target: Annotated[TargetKind | None, typer.Option("--target", help="Kind of target.")] = None,
    speed: Annotated[list[float] | None, typer.Option("--speed", help="Of the target, m/s; repeatable.")] = None,
    slice_s: Annotated[float | None, typer.Option("--slice", help="Minimum run time of all, seconds.")] = None,
    order: Annotated[TurnOrder | None, typer.Option("--order", help="Whose turns come first.")] = None,
    driven: Annotated[float | None, typer.Option("--driven", help=SHARE_DRIVEN)] = None,
    noise: Annotated[float | None, typer.Option("--noise", help="Of the pictures: 0 none, 1 as in the papers.")] = None,
    frames: Annotated[int | None, typer.Option("--frames", help="Certain pictures a watcher wants.")] = None,
    trials: Trials = 200,
    seed: Seed = 1,
    jobs: Jobs = 0,
    as_json: AsJson = False,
    plot: PlotTo = None,
    traces: TracesTo = None,
    mission_file: Annotated[
        bool, typer.Option("--mission-file", help="Print the mission file of the first condition, run nothing.")
    ] = False,
) -> None:
    """Let a target pass Scouts that watch in turns; count how often it is detected.

    Without options for a condition: the published conditions of both papers, and the adaptive policy beside them.
    """
    from mission_control.laboratory.experiments.conditions import EVERYTHING, ImpossibleCondition, checked
    from mission_control.laboratory.experiments.mission_file import mission_text

    given: dict[str, object] = {
        "active": active,
        "channels": channels,
        "target": target and str(target),
        "slice_s": slice_s,
        "order": order and str(order),
        "driven": driven,
        "noise": noise,
        "frames_wanted": frames,
    }
    fixed = {name: value for name, value in given.items() if value is not None}
    if fixed or extra or policy or speed:
        try:
            conditions = [
                checked(**fixed, policy=str(how), extra=many, speed_m_s=fast)
                for how in policy or [Policy.PAPER]
                for fast in speed or [0.0]
                for many in (extra if extra else range(4))
            ]
        except ImpossibleCondition as refusal:
            _refuse(refusal)
    else:
        conditions = list(EVERYTHING)
    if mission_file:
        print(mission_text(conditions[0]), end="")
        return
    _run(conditions, "Surveillance", trials, seed, jobs, as_json=as_json, plot=plot, traces=traces)


@app.command()
def load(
    policy: Annotated[Policy, typer.Option("--policy", help="Policy of the requests.")] = Policy.PAPER,
    channels: Annotated[int, typer.Option("--channels", min=1, max=4, help="Video frequencies.")] = 1,
    driven: Annotated[float, typer.Option("--driven", min=0.0, max=1.0, help=SHARE_DRIVEN)] = 1.0,
    trials: Trials = 100,
    seed: Seed = 1,
    jobs: Jobs = 0,
    as_json: AsJson = False,
    plot: PlotTo = None,
    traces: TracesTo = None,
) -> None:
    """Put 2 to 10 robots on one channel, two of which watch; count how often a passing target is detected."""
    from mission_control.laboratory.experiments.conditions import load_conditions

    conditions = list(load_conditions(policy.value, channels, driven))
    _run(conditions, "Load: 2 to 10 robots", trials, seed, jobs, as_json=as_json, plot=plot, traces=traces)


@app.command()
def servoing(
    trials: Annotated[int, typer.Option("--trials", min=1, max=MOST_TRIALS, help="Starts.")] = 100,
    seed: Seed = 1,
    noise: Annotated[float, typer.Option("--noise", min=0, max=10, help="Of the pictures: 0 none, 1 papers'.")] = 1.0,
    jobs: Jobs = 0,
    as_json: AsJson = False,
) -> None:
    """Let a Scout find a landmark up to 2.5 m away and up to 45° aside; count how often it ends at its place."""
    from rich.console import Console

    from mission_control.laboratory.experiments.screen import progress_bar, servo_table
    from mission_control.laboratory.experiments.servoing import run_servoing

    with progress_bar(Console(stderr=True), "trials") as progress:
        outcome = run_servoing(trials=trials, seed=seed, noise=noise, jobs=jobs, progress=progress)
    if as_json:
        print(json.dumps(outcome.to_json()))
    else:
        Console(width=None if sys.stdout.isatty() else PIPE_WIDTH).print(servo_table(outcome))


def run(arguments: list[str]) -> int:
    """Run ``scout-backbone experiment`` with these arguments; return the exit code."""
    return app(arguments, prog_name="scout-backbone experiment", standalone_mode=False) or 0


def _run(
    conditions: list[Any],
    title: str,
    trials: int,
    seed: int,
    jobs: int,
    *,
    as_json: bool,
    plot: Path | None,
    traces: Path | None,
) -> None:
    from rich.console import Console

    from mission_control.laboratory.experiments import plot as plotting
    from mission_control.laboratory.experiments.screen import progress_bar, summary, table
    from mission_control.laboratory.experiments.surveillance import run_surveillance

    try:
        if plot is not None:
            plotting.require_format(plot)
            plot.parent.mkdir(parents=True, exist_ok=True)
        if traces is not None:
            traces.mkdir(parents=True, exist_ok=True)
            if any(traces.iterdir()):  # traces of another run would stand among these
                raise FileUnusable(f"{traces} is not empty", remedy="Name a new folder.")
        with progress_bar(Console(stderr=True), "trials") as progress:
            outcome = run_surveillance(
                conditions, trials=trials, seed=seed, jobs=jobs, progress=progress, traces=traces
            )
    except Refusal as refusal:
        _refuse(refusal)
    except OSError as error:
        _end_unwritten(error)
    if as_json:
        print(json.dumps(outcome.to_json()))
    else:
        Console(width=None if sys.stdout.isatty() else PIPE_WIDTH).print(table(outcome, title))
    print(summary(outcome), file=sys.stderr)
    if plot is not None:  # last: without the picture the result of all trials is still there
        try:
            plotting.plot(outcome, plot, title)
        except OSError as error:
            _end_unwritten(error)
    if not outcome.is_sound:
        for row in outcome.rows:
            for said in row.disagreements[:3]:
                print(f"{row.condition.title()}: {said}", file=sys.stderr)
        raise typer.Exit(int(ExitCode.MISSION_FAILED))


def _end_unwritten(error: OSError) -> NoReturn:
    print(f"cannot be written: {error}", file=sys.stderr)
    raise typer.Exit(int(ExitCode.MISSION_FAILED)) from None


def _refuse(refusal: Refusal) -> NoReturn:
    print(f"refused [{code_of(refusal)}]: {refusal}", file=sys.stderr)
    raise typer.Exit(int(ExitCode.USAGE)) from None
