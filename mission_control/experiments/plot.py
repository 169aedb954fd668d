"""A picture of an experiment's rates, as PNG or SVG; needs the extra ``plot``."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from backbone.errors import Refusal
from mission_control.experiments.conditions import PUBLISHED
from mission_control.experiments.intervals import wilson
from mission_control.experiments.surveillance import Outcome, Row


class NoPlotting(Refusal):
    """No plotting library is installed."""

    code = "experiment.no_plotting"
    remedy = "Install the extra: pip install 'scout-backbone[plot]'."


def require_plotting() -> None:
    """Return if pictures can be drawn here.

    Raises:
        NoPlotting: They cannot.
    """
    try:
        import_module("matplotlib")
    except ImportError as error:
        raise NoPlotting(f"matplotlib cannot be imported: {error}") from error


def plot(outcome: Outcome, file: Path, title: str) -> None:
    """Write a picture of the rates over the number of extra robots, a line for each policy and way of driving.

    Raises:
        NoPlotting: There is no plotting library.
        OSError: The file cannot be written.
    """
    require_plotting()
    figure = import_module("matplotlib.figure").Figure(figsize=(8, 5), layout="constrained")
    axes = figure.subplots()
    for name, rows in _series(outcome.rows).items():
        extra = [row.condition.extra for row in rows]
        rates = [100 * row.rate for row in rows]
        below = [100 * (row.rate - row.interval95[0]) for row in rows]
        above = [100 * (row.interval95[1] - row.rate) for row in rows]
        (line,) = axes.plot(extra, [100 * row.predicted for row in rows], linestyle=":")
        axes.errorbar(extra, rates, yerr=[below, above], label=name, marker="o", capsize=3, color=line.get_color())
    published = [(row.condition, given) for row in outcome.rows if (given := PUBLISHED.get(row.condition))]
    counted = [(condition, given) for condition, given in published if given.trials]
    if counted:
        rates = [given.detected / given.trials for _, given in counted]
        bounds = [wilson(given.detected, given.trials) for _, given in counted]
        axes.errorbar(
            [condition.extra + 0.06 for condition, _ in counted],
            [100 * rate for rate in rates],
            yerr=[
                [100 * (rate - low) for rate, (low, _) in zip(rates, bounds, strict=True)],
                [100 * (high - rate) for rate, (_, high) in zip(rates, bounds, strict=True)],
            ],
            label="the papers",
            linestyle="none",
            marker="s",
            color="gray",
            capsize=3,
        )
    axes.set(title=title, xlabel="extra robots", ylabel="detected, % (dotted: predicted)", ylim=(0, 103))
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.grid(alpha=0.3)
    axes.legend()
    figure.savefig(file, dpi=110)


def _series(rows: Sequence[Row]) -> dict[str, list[Row]]:
    found: dict[str, list[Row]] = {}
    for row in rows:
        condition = row.condition
        name = f"{condition.policy}, {condition.target} {condition.passage.speed_m_s:g} m/s"
        name += f", {condition.channels} channels" if condition.channels > 1 else ""
        name += f", driven {condition.driven:.0%}" if condition.driven < 1 else ""
        name += f", noise x {condition.noise:g}" if condition.noise != 1 else ""
        found.setdefault(name, []).append(row)
    return found
