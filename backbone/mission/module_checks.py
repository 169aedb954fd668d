"""Consistency checks of modules and execution units.

This file checks names, parameters and places. The class that runs execution units checks the connections, because the
modules' classes declare their inputs and outputs.
"""

from __future__ import annotations

from collections.abc import Iterator

from backbone.mission.arranged import CLASS, UnitFault, UnitsQuestion
from backbone.mission.class_paths import CLASS_PATH, class_path_fault
from backbone.mission.document import Element
from backbone.mission.model import EXECUTION_UNIT
from backbone.mission.parameter_checks import check_class_path
from backbone.mission.report import Place, Report
from backbone.mission.tables import Tables, check_host, check_parameters, check_unique, parameters


def check_modules(tables: Tables, report: Report) -> None:
    """Report every fault of units and modules that can be seen without their classes."""
    section = tables.root.first("modules")
    if section is None:
        return
    modules = [module for unit in tables.units for module in unit.all("module")]
    check_unique(section.all("given"), "key", "given key", report)
    check_unique(section.all("quality"), "key", "quality of", report)
    check_unique(modules, "name", "module", report)
    check_unique([choice for unit in tables.units for choice in unit.all("choose")], "key", "choice of", report)
    for element in (*section.all("given"), *modules):
        if CLASS_PATH.fullmatch(element.text("class")):
            check_class_path(element, "class", report)
    for unit in tables.units:
        check_host(unit, tables, report)
        if not unit.all("module"):
            report.fault(unit.place, f"unit {unit.text('name')} has no module", "Add a <module>, or remove the unit")
    for module in modules:
        check_parameters(module, (), report)
        check_unique(module.all("input"), "name", "key of input", report)
        check_unique(module.all("output"), "name", "key of output", report)


def units_question(tables: Tables) -> UnitsQuestion | None:
    """Return the question to the class that runs units; None: there are no units, or their faults are plain."""
    section = tables.root.first("modules")
    if section is None or not tables.units:
        return None
    modules = [module for unit in tables.units for module in unit.all("module")]
    if len({module.text("name") for module in modules}) < len(modules):
        return None
    paths = {element.text("class") for element in (*section.all("given"), *modules)}
    if any(not CLASS_PATH.fullmatch(path) or class_path_fault(path) for path in paths):
        return None
    return UnitsQuestion(
        tables.types[EXECUTION_UNIT].text("class"),
        tuple(map(_unit, tables.units)),
        {
            one.text("key"): {
                "type": one.text("class"),
                "source": {"address": one.text("address"), "conversation": one.text("conversation")},
            }
            for one in section.all("given")
        },
        {one.text("key"): _quality(one) for one in section.all("quality")},
    )


def report_units(tables: Tables, faults: tuple[UnitFault, ...], report: Report) -> None:
    """Report each fault at its place in the file."""
    for fault in faults:
        report.fault(_place(tables, fault), fault.message, fault.remedy)


def _unit(unit: Element) -> dict[str, object]:
    return {
        "name": unit.text("name"),
        "frequency_hz": unit.number("frequency-hz") or 0.0,
        "on_input": unit.text("on-input"),
        "own_thread": bool(unit.flag("own-thread")),
        "nice": int(unit.text("nice") or 0),
        "cpus": [int(number) for number in unit.text("cpus").split()],
        "modules": [
            {
                "name": module.text("name"),
                "class_path": module.text("class"),
                "parameters": parameters(module),
                "inputs": {one.text("name"): one.text("key") for one in module.all("input")},
                "outputs": {one.text("name"): one.text("key") for one in module.all("output")},
            }
            for module in unit.all("module")
        ],
        "choices": [
            {"key": one.text("key"), "source": one.text("from"), "others": one.text("or").split()}
            for one in unit.all("choose")
        ],
    }


def _quality(element: Element) -> dict[str, object]:
    return {
        "reliable": bool(element.flag("reliable")),
        "urgency": element.text("urgency"),
        "express": bool(element.flag("express")),
        "most_bytes": int(element.text("most-bytes")),
        "deadline_s": element.number("deadline-s") or 0.0,
    }


def _place(tables: Tables, fault: UnitFault) -> Place:
    """Return the place of the port in the module, of the module, of the unit, or of the given key."""
    return next(_places(tables, fault), tables.root.place)


def _places(tables: Tables, fault: UnitFault) -> Iterator[Place]:
    section = tables.root.first("modules")
    for unit in tables.units:
        for module in unit.all("module"):
            if fault.module and module.text("name") == fault.module:
                if fault.port == CLASS:
                    yield module.place_of("class")
                for part in module.children:
                    if part.text("name") == fault.port:
                        yield part.place_of("value" if part.tag == "parameter" else "key")
                yield module.place_of("name")
        for choice in unit.all("choose"):
            if fault.module == f"choose-{choice.text('key')}":
                yield choice.place_of("from" if fault.port.startswith("from") else "key")
        if fault.unit and unit.text("name") == fault.unit:
            yield unit.place_of("name")
    if section is not None:
        yield from (one.place_of("class") for one in section.all("given") if one.text("key") == fault.given)
        yield from (one.place_of("key") for one in section.all("quality") if one.text("key") == fault.quality)
        yield section.place
