"""What a module of an execution unit waits for, as lines for people. Pure."""

from __future__ import annotations

from collections.abc import Collection

from backbone.component.messages import ComponentState
from backbone.creator.messages import Spawn
from backbone.mission.model import EXECUTION_UNIT
from backbone.module_waits import AwaitedInput, ModuleWaits
from backbone.naming import component_of
from backbone.placer.messages import Start
from backbone.spoken import counted


def module_lines(name: str, unit: ComponentState, waits: ModuleWaits, there: Collection[str]) -> list[str]:
    """Return what the module does, and, if it does not compute, a line for each input that it waits for.

    Args:
        there: Addresses of the mission's components.
    """
    runs = "has not run yet" if not waits.runs else f"has run {counted(waits.runs, 'time')}"
    first = f"{name} is a module of {component_of(unit.address)}, which is {unit.state} on {unit.host}; it {runs}"
    if waits.computes_since_s is not None:
        return [first, f"  it computes since {waits.computes_since_s:.3f} s"]
    if not waits.awaited:
        return [first, "  it has its inputs, and runs in the next round"]
    one_of = "" if waits.needs_all or len(waits.awaited) == 1 else "one of these is enough: "
    return [first, *(f"  {one_of}it waits for {_awaited(one, there)}" for one in waits.awaited)]


def modules_of(order: Spawn | Start) -> list[str]:
    """Return the names of the modules in the order that starts a unit; none for other components."""
    modules = order.parameters.get("modules") if order.type == EXECUTION_UNIT else None
    return [str(one.get("name")) for one in modules if isinstance(one, dict)] if isinstance(modules, list) else []


def _awaited(awaited: AwaitedInput, there: Collection[str]) -> str:
    value = f"the next {awaited.key}" if awaited.has_come else f"the first {awaited.key}"
    source = "/".join(awaited.source.split("/")[:2])
    if "/" not in source:
        return f"{value}, from module {source} of its unit"
    absent = "" if source in there else ", which is absent"
    late = "; it is late" if awaited.is_late else ""
    return f"{value}, from {component_of(source)}{absent}{late}"
