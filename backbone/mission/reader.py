"""Reads a mission file and returns its checked description, or raises all its faults."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from pathlib import Path

from backbone.mission.arranged import Arranged
from backbone.mission.checks import check
from backbone.mission.class_asking import arrange, ask_classes, judge
from backbone.mission.class_facts import ClassFacts, shipped_classes
from backbone.mission.class_paths import CLASS_PATH, class_path_fault
from backbone.mission.completion import complete
from backbone.mission.describe import describe
from backbone.mission.document import Element, parse, read_bytes
from backbone.mission.model import MissionDescription
from backbone.mission.module_checks import report_units, units_question
from backbone.mission.parameter_checks import open_questions, report_refusal
from backbone.mission.report import Fault, MissionInvalid, Report
from backbone.mission.tables import Tables, section
from backbone.mission.validation import fill_defaults, repair, validated

__all__ = ["Fault", "MissionInvalid", "read_mission", "read_mission_bytes", "read_written_mission"]


log = logging.getLogger(__name__)


def read_mission(path: str | Path) -> MissionDescription:
    """Return the mission in the file; see ``read_written_mission``."""
    return read_written_mission(path)[0]


def read_written_mission(
    path: str | Path, warn: Callable[[str], object] = log.warning
) -> tuple[MissionDescription, bytes]:
    """Return the mission in the file, and the file's content. No component is started.

    A separate process imports the classes of the file's own types, to ask them for their parameters.

    Args:
        path: The mission file; faults contain this path.
        warn: Called with a line for each class that could not be asked, so that the check is incomplete.

    Raises:
        MissionInvalid: With every fault of the file, in its order.
    """
    report = Report(str(path))
    data = read_bytes(Path(path), report)
    if data is None:
        raise MissionInvalid(report.faults())
    return read_mission_bytes(data, str(path), warn=warn), data


def read_mission_bytes(
    data: bytes,
    source: str,
    classes: Mapping[str, ClassFacts] | None = None,
    warn: Callable[[str], object] = log.warning,
) -> MissionDescription:
    """Return the mission in these bytes, as ``read_mission`` does for a file.

    Args:
        data: Content of the file, or planned content.
        source: Its path, for faults; other files named in the mission are relative to it.
        classes: Facts of classes besides the shipped ones; the connections of modules are not checked then. None: ask
            the classes that the mission names, those of modules included.
        warn: As for ``read_written_mission``.

    Raises:
        MissionInvalid: With every fault, in the order of the file.
    """
    report = Report(source)
    root, mission = parse(data, report), None
    known: Mapping[str, ClassFacts] = {}
    arranged = Arranged()
    if root is not None and repair(root, report):
        complete(root)
        mission = validated(root, report)
        fill_defaults(root)
        known = known_classes(root) if classes is None else {**classes, **shipped_classes()}
        check(root, known, report)
        if classes is None:
            _check_rules(root, known, report, warn)
            arranged = _arranged(root, report) if mission is not None else arranged
    faults = report.faults()
    if faults or mission is None:
        raise MissionInvalid(faults)
    return describe(mission, source, known, arranged.parameters)


def _check_rules(
    root: Element, classes: Mapping[str, ClassFacts], report: Report, warn: Callable[[str], object]
) -> None:
    """Report parameters that their class refuses, by rules that only the class can check."""
    tables = Tables.of(root, classes)
    opened = open_questions(tables)
    refusals, silent = judge([question for _, question in opened])
    for (element, question), refusal in zip(opened, refusals, strict=True):
        if refusal:
            report_refusal(element, refusal, tables, report)
        elif reason := silent.pop(question.class_path, ""):
            what = f"warning: whether {question.class_path} starts with its parameters is unknown: {reason}"
            warn(str(Fault(report.file, *element.place, what, "Mend its __post_init__, or see whether it starts")))


def _arranged(root: Element, report: Report) -> Arranged:
    """Return how the modules are connected; report those that cannot be connected."""
    tables = Tables.of(root)
    question = units_question(tables)
    answer = Arranged() if question is None else arrange(question)
    report_units(tables, answer.faults, report)
    return answer


def known_classes(root: Element) -> dict[str, ClassFacts]:
    """Return the facts of the classes of a mission's types; its own classes are imported in another process."""
    known = shipped_classes()
    paths = {one.text("class") for one in section(root, "types")}
    asked = [path for path in sorted(paths - known.keys()) if CLASS_PATH.fullmatch(path) and not class_path_fault(path)]
    tables = Tables.of(root, {**known, **ask_classes(asked)})
    drivers = map(tables.driven, section(root, "resources"))
    bodies = map(tables.embodied, () if tables.world is None else tables.world.all("robot"))
    planners = map(tables.planned, section(root, "core"))
    return {**tables.classes, **ask_classes([one for one in (*drivers, *bodies, *planners) if one])}
