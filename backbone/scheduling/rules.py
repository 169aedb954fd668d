"""The scheduling rules that a mission can choose.

Rule of this file: plain data with its ranges, so that the same types validate a mission file and start the RC manager.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Literal, get_args

from msgspec import Meta, Struct, ValidationError, convert

from backbone.scheduling.fairness import Discipline
from backbone.scheduling.response_time import Analysis

Policy = Literal["no_delay", "strict"]

ROUNDING = 1e-9  # chosen: a slice that ends on the grid but for rounding ends on it
SHORTEST_AGING_S = 1.0  # chosen: longer than common RCs settle; check compares with those of the mission
LONGEST_S = 86_400.0  # chosen: a day, as for all other times of a mission file


class SchedulingRules(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Rules of the RC manager; ``check`` prints their descriptions.

    Raises:
        ValueError: A rule is not known, or a time is below its least.
    """

    policy: Annotated[
        Policy,
        Meta(
            description="no_delay: lower ARCs fill gaps without delaying others; "
            "strict: no ARC starts while a higher one waits"
        ),
    ] = "no_delay"
    discipline: Annotated[
        Discipline, Meta(description="turns: equals each get their minimum run time in turn; time: they get equal time")
    ] = "turns"
    admission: Annotated[
        Analysis,
        Meta(description="exact: a sharable resource serves streams that are always in time; sum: up to its capacity"),
    ] = "exact"
    aging_s: Annotated[
        float,
        Meta(
            ge=0,
            le=LONGEST_S,
            description="a waiting ARC rises one level each time this many seconds have passed, at least 1; 0: never",
        ),
    ] = 0.0
    grid_s: Annotated[
        float, Meta(ge=0, le=LONGEST_S, description="slices end at multiples of this many seconds; 0: no grid")
    ] = 0.0
    grace_s: Annotated[
        float,
        Meta(ge=0, le=LONGEST_S, description="seconds a decision process has to stop cleanly at the end of a slice"),
    ] = 0.2
    planner: Annotated[
        str,
        Meta(
            pattern=r"^([A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*)?$",
            description="class path of a planner of your own, as package.module:Class; empty: the RC manager's own",
        ),
    ] = ""

    def slice_end_s(self, granted_s: float, minimum_s: float) -> float:
        """Return the end of a slice granted at this time, unless it is preempted or extended.

        Example:
            >>> SchedulingRules().slice_end_s(1.5, 5.0), SchedulingRules(grid_s=4.0).slice_end_s(1.5, 5.0)
            (6.5, 8.0)
        """
        end_s = granted_s + minimum_s
        return math.ceil(end_s / self.grid_s - ROUNDING) * self.grid_s if self.grid_s else end_s

    def __post_init__(self) -> None:
        for rule in ("policy", "discipline", "admission"):
            if getattr(self, rule) not in values_of(rule):
                known = " and ".join(values_of(rule))
                raise ValueError(f"unknown {rule} {getattr(self, rule)!r}; there are {known}")
        for rule in ("aging_s", "grid_s", "grace_s"):
            if not 0 <= getattr(self, rule) < math.inf:
                raise ValueError(f"{rule} is {getattr(self, rule)}; it must be at least 0")
        if 0 < self.aging_s < SHORTEST_AGING_S:
            raise ValueError(f"aging_s is {self.aging_s}; it must be 0 (never) or at least {SHORTEST_AGING_S:g}")


def values_of(rule: str) -> tuple[str, ...]:
    """Return the legal words of a rule; none if it is a time.

    Example:
        >>> values_of("policy"), values_of("grid_s")
        (('no_delay', 'strict'), ())
    """
    return {"policy": get_args(Policy), "discipline": get_args(Discipline), "admission": get_args(Analysis)}.get(
        rule, ()
    )


def rule_fault(rule: str, value: object) -> str:
    """Return why the rules cannot have this value; empty: they can.

    Example:
        >>> rule_fault("aging_s", 0.5), rule_fault("aging_s", 10)
        ('aging_s is 0.5; it must be 0 (never) or at least 1', '')
    """
    try:
        convert({rule: value}, SchedulingRules)
    except ValidationError as error:
        return str(error)
    return ""


def aging_fault(aging_s: float, handed_over_s: Mapping[str, float]) -> str:
    """Return why waiting ARCs cannot rise each time this many seconds have passed; empty: they can.

    Args:
        aging_s: The rule; 0: they never rise.
        handed_over_s: RC → seconds that it needs to disconnect and connect.

    Example:
        >>> aging_fault(2.0, {"video1": 3.0, "radio": 0.5}).partition(", so")[0]
        'aging_s is 2, and video1 needs 3 s to disconnect and connect'
    """
    slowest = max(handed_over_s, key=handed_over_s.__getitem__, default="")
    if not slowest or not 0 < aging_s < handed_over_s[slowest]:
        return ""
    return (
        f"aging_s is {aging_s:g}, and {slowest} needs {handed_over_s[slowest]:g} s to disconnect and connect, "
        "so waiting ARCs would override each other before a grant"
    )
