"""Draws the measurements of ``placements.py``: latency over size by way, both axes logarithmic, floors dashed.

Source of the picture: RoboFrame 2006, Figure 5.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

from mission_control.laboratory.experiments.plot import COLORS, GREY, MARKERS

NAMES = {
    "unit": "in one unit",
    "thread": "in two threads",
    "board": "in two processes, blackboard",
    "network": "in two processes, network",
    "queue": "floor: bare threads and a queue",
    "socket": "floor: bare unix socket",
    "zenoh": "floor: bare zenoh",
}


def draw(p50_us: Mapping[str, Mapping[int, float]], floors: Mapping[str, str], file: Path) -> None:
    """Write the picture, PNG or SVG by the file's name.

    Args:
        p50_us: Way → size in bytes → latency.
        floors: Way → its floor, which is drawn in the same color.
    """
    numbers = {way: number for number, way in enumerate(way for way in NAMES if way not in floors.values())}
    numbers |= {floor: numbers[way] for way, floor in floors.items()}
    with rc_context({"svg.fonttype": "none", "font.size": 10}):
        figure = Figure(figsize=(10, 6), layout="constrained")
        axes = figure.subplots()
        for way, name in NAMES.items():
            sizes = sorted(p50_us[way])
            is_floor, number = way in floors.values(), numbers[way]
            axes.plot(
                sizes,
                [p50_us[way][size] for size in sizes],
                color=COLORS[number],
                marker=MARKERS[number],
                linestyle="--" if is_floor else "-",
                markerfacecolor="none" if is_floor else COLORS[number],
                label=name,
            )
        axes.set(xscale="log", yscale="log", xlabel="size of a value, bytes", ylabel="from module to module, p50, µs")
        axes.grid(color=GREY, alpha=0.2)
        axes.legend(frameon=False)
        figure.savefig(file)
