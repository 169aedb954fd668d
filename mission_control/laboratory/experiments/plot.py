"""Plot of an experiment's rates, as PNG or SVG; needs the extra ``plot``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from backbone.errors import Refusal
from mission_control.laboratory.experiments.conditions import PUBLISHED, Condition
from mission_control.laboratory.experiments.intervals import wilson
from mission_control.laboratory.experiments.surveillance import ConditionRow, SurveillanceOutcome, trials_line

COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000")
"""Okabe and Ito, "Color Universal Design", 2008: distinct for all kinds of color vision. Without yellow: too pale."""
MARKERS = ("o", "^", "D", "v", "P", "X", "*")
"""Distinguishes series even without color."""
GREY = "#555555"
SIDE_BY_SIDE = 0.035  # chosen: intervals of one load are beside each other, but clearly belong together
FORMATS = (".png", ".svg")  # chosen: others of the library fail after all trials, as .pgf without LaTeX
LEAST_GAP = 4.5  # chosen: a line of text in percent of the picture's height


class NoPlotting(Refusal):
    """No plotting library is installed."""

    code = "experiment.no_plotting"
    remedy = "Install the extra: pip install 'scout-backbone[plot]'."


class UnknownFormat(Refusal):
    """A plot is PNG or SVG."""

    code = "experiment.plot_format"
    remedy = "Let the file's name end with .png or .svg."


class Point(NamedTuple):
    """A counted rate, in percent.

    Attributes:
        extra: Number of extra robots.
        low: Lower end of its 95 % interval.
        high: Upper end.
        predicted: Rate predicted from geometry and schedule; None: no prediction.
    """

    extra: float
    rate: float
    low: float
    high: float
    predicted: float | None = None


def require_plotting() -> None:
    """Check that a plotting library is installed.

    Raises:
        NoPlotting: No plotting library is installed.
    """
    try:
        import_module("matplotlib")
    except ImportError as error:
        raise NoPlotting(f"matplotlib cannot be imported: {error}") from error


def require_format(file: Path) -> None:
    """Check that a plot can be written to a file of this name.

    Raises:
        NoPlotting: No plotting library is installed.
        UnknownFormat: The name has another ending than those of ``FORMATS``.
    """
    require_plotting()
    if file.suffix.lower() not in FORMATS:
        raise UnknownFormat(f"no plot can be written to {file.name!r}")


def plot(outcome: SurveillanceOutcome, file: Path, title: str) -> None:
    """Write a plot of the rates over the number of extra robots, a line for each policy and way of driving.

    Each line has its name beside its end; conditions, trials and seed are above the plot.

    Raises:
        NoPlotting: No plotting library is installed.
        OSError: The file cannot be written.
    """
    require_plotting()
    with import_module("matplotlib").rc_context({"svg.fonttype": "none", "font.size": 10}):
        figure = import_module("matplotlib.figure").Figure(figsize=(10, 6), layout="constrained")
        axes = figure.subplots()
        shown = series(outcome.rows)
        for number, (name, points) in enumerate(shown.items()):
            _draw(axes, points, number, len(shown), is_published=_is_published(name))
        _name(axes, shown)
        axes.set(xlabel="extra robots", ylabel="detected, %", ylim=(-2, 103))
        figure.suptitle(title, x=0.01, ha="left", fontweight="bold")
        axes.set_title(f"{trials_line(outcome)}\n{LEGEND}", loc="left", fontsize=9, color=GREY)
        axes.xaxis.get_major_locator().set_params(integer=True)
        axes.grid(alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
        figure.savefig(file, dpi=150)


THE_PAPERS = "the papers"
LEGEND = "bars: Wilson's 95 % intervals; dotted: predicted by geometry and schedule alone"


def series(rows: Sequence[ConditionRow]) -> Mapping[str, Sequence[Point]]:
    """Return the points of each line by its name; the papers' counts come last."""
    found: dict[str, list[Point]] = {}
    for row in rows:
        low, high = row.interval95
        point = Point(row.condition.extra, 100 * row.rate, 100 * low, 100 * high, 100 * row.predicted)
        found.setdefault(_name_of(row.condition), []).append(point)
    for row in rows:
        given = PUBLISHED.get(row.condition)
        if given is not None and given.trials:
            low, high = wilson(given.detected, given.trials)
            point = Point(row.condition.extra, 100 * given.detected / given.trials, 100 * low, 100 * high)
            found.setdefault(f"{THE_PAPERS}, {row.condition.target}", []).append(point)
    return {name: sorted(points) for name, points in sorted(found.items(), key=lambda item: _is_published(item[0]))}


def apart(heights: Sequence[float], gap: float = LEAST_GAP) -> list[float]:
    """Return heights at least a gap apart, in the same order, each near its original.

    Example:
        >>> apart([50.0, 50.0, 10.0], 4.0)
        [48.0, 52.0, 10.0]
    """
    order = sorted(range(len(heights)), key=lambda place: heights[place])
    blocks: list[tuple[float, list[int]]] = []  # middle and indices of touching neighbors
    for place in order:
        middle, members = heights[place], [place]
        while blocks and middle - blocks[-1][0] < gap * (len(members) + len(blocks[-1][1])) / 2:
            below, others = blocks.pop()
            weight = len(others) + len(members)
            middle, members = (below * len(others) + middle * len(members)) / weight, [*others, *members]
        blocks.append((middle, members))
    placed = {
        place: middle + gap * (number - (len(members) - 1) / 2)
        for middle, members in blocks
        for number, place in enumerate(members)
    }
    return [placed[place] for place in range(len(heights))]


def _draw(axes: Any, points: Sequence[Point], number: int, of: int, *, is_published: bool) -> None:
    color = GREY if is_published else COLORS[number % len(COLORS)]
    extra = [point.extra + _beside(number, of) for point in points]
    predicted = [point for point in points if point.predicted is not None]
    axes.plot([p.extra for p in predicted], [p.predicted for p in predicted], linestyle=":", color=color, linewidth=1)
    axes.errorbar(
        extra,
        [point.rate for point in points],
        yerr=[[point.rate - point.low for point in points], [point.high - point.rate for point in points]],
        color=color,
        marker="s" if is_published else MARKERS[number % len(MARKERS)],
        linestyle="none" if is_published else "-",
        linewidth=1.2,
        elinewidth=0.8,
        capsize=2.5,
        markersize=5,
    )


def _name(axes: Any, shown: Mapping[str, Sequence[Point]]) -> None:
    """Write the name of each line beside its last point, on the right of all."""
    right = max((points[-1].extra for points in shown.values()), default=0.0)
    left = min((points[0].extra for points in shown.values()), default=0.0)
    axes.set_xlim(left - 0.2, right + 0.2)  # with a single point, too, the names are close to the axes
    heights = apart([points[-1].rate for points in shown.values()])
    for number, ((name, points), height) in enumerate(zip(shown.items(), heights, strict=True)):
        color = GREY if _is_published(name) else COLORS[number % len(COLORS)]
        axes.annotate(
            name,
            xy=(points[-1].extra + _beside(number, len(shown)), points[-1].rate),
            xytext=(right + 0.25, height),
            color=color,
            fontsize=9,
            va="center",
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": color, "linewidth": 0.6, "alpha": 0.4, "shrinkA": 1, "shrinkB": 6},
        )


def _beside(number: int, of: int) -> float:
    """Return the sideways offset of this line's points."""
    return SIDE_BY_SIDE * (number - (of - 1) / 2)


def _is_published(name: str) -> bool:
    return name.startswith(THE_PAPERS)


def _name_of(condition: Condition) -> str:
    name = f"{condition.policy}, {condition.target} {condition.passage.speed_m_s:g} m/s"
    name += f", {condition.channels} channels" if condition.channels > 1 else ""
    name += f", driven {condition.driven:.0%}" if condition.driven < 1 else ""
    name += ", no noise" if not condition.noise else f", noise x {condition.noise:g}" if condition.noise != 1 else ""
    return name
