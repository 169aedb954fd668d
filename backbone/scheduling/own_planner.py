"""Loads a planner that the mission file names by its class path."""

from __future__ import annotations

import inspect
from typing import Protocol, cast

from backbone.errors import Refusal
from backbone.import_faults import import_fault, object_at
from backbone.scheduling.planner import Planner
from backbone.scheduling.table import Table

MEND = "Correct the fault that the message names in the planner's file."


class PlannerType(Protocol):
    """The class of a planner."""

    def __call__(self, table: Table, *, slack_s: float) -> Planner:
        """Return a planner without plans.

        Args:
            table: Questions about the schedule.
            slack_s: Longest overlap of two reservations.
        """


class WrongPlanner(Refusal):
    """A class path does not lead to a planner."""

    code = "scheduler.planner"
    remedy = "Write the planner as package.module:Class, a class with all of backbone.scheduling.planner:Planner."


def load_planner(class_path: str) -> PlannerType | None:
    """Return the planner class at ``package.module:Class``; None for an empty path.

    Raises:
        WrongPlanner: The path does not lead to a class, its file cannot be imported, or the class lacks a method of a
            planner.
    """
    if not class_path:
        return None
    try:
        found = object_at(class_path)
    except (Exception, SystemExit) as error:  # a file that is being written raises anything
        told, remedy = import_fault(class_path, error)
        raise WrongPlanner(told, remedy=remedy and MEND, class_path=class_path) from error
    lacking = sorted(one for one in vars(Planner) if not one.startswith("_") and not _has(found, one))
    if lacking or not isinstance(found, type):
        raise WrongPlanner(f"{class_path} is no planner: it lacks {', '.join(lacking)}", class_path=class_path)
    try:
        inspect.signature(found).bind(None, slack_s=0.0)
    except TypeError as error:
        told = f"{class_path}: its constructor: {error}; it is called as {found.__name__}(table, slack_s=…)"
        raise WrongPlanner(told, remedy=MEND, class_path=class_path) from error
    return cast(PlannerType, found)


def _has(found: object, name: str) -> bool:
    """Return whether the class defines this, or declares it as an attribute of its objects."""
    declared = (inspect.get_annotations(base) for base in getattr(found, "__mro__", ()))
    return hasattr(found, name) or any(name in one for one in declared)
