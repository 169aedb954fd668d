"""From a mission file to a checked mission description, or to everything that is wrong with it."""

from __future__ import annotations

from collections.abc import Mapping
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


def read_mission(path: str | Path) -> MissionDescription:
    """Return the mission the file describes; see ``read_written_mission``."""
    return read_written_mission(path)[0]


def read_written_mission(path: str | Path) -> tuple[MissionDescription, bytes]:
    """Return the mission the file describes, and what the file holds. No component is started.

    The classes of the file's own types are asked for their parameters in a process of its own, which imports them.

    Args:
        path: The mission file; faults name it as it is given here.

    Raises:
        MissionInvalid: With every fault of the file, in its order.
    """
    report = Report(str(path))
    data = read_bytes(Path(path), report)
    if data is None:
        raise MissionInvalid(report.faults())
    return read_mission_bytes(data, str(path)), data


def read_mission_bytes(data: bytes, source: str, classes: Mapping[str, ClassFacts] | None = None) -> MissionDescription:
    """Return the mission these bytes describe, as ``read_mission`` does of a file that holds them.

    Args:
        data: What the file holds or would hold.
        source: Its path; faults name it, and files that the mission names are looked for beside it.
        classes: What is known of classes besides the shipped ones; None: those that the mission names are asked, those
            of modules, too. Otherwise the connections of modules are not worked out.

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
            _check_rules(root, known, report)
            arranged = _arranged(root, report) if mission is not None else arranged
    faults = report.faults()
    if faults or mission is None:
        raise MissionInvalid(faults)
    return describe(mission, source, known, arranged.parameters)


def _check_rules(root: Element, classes: Mapping[str, ClassFacts], report: Report) -> None:
    """Report parameters that only their class can judge, and refuses."""
    tables = Tables.of(root, classes)
    opened = open_questions(tables)
    for (element, _), refusal in zip(opened, judge([question for _, question in opened]), strict=True):
        if refusal:
            report_refusal(element, refusal, tables, report)


def _arranged(root: Element, report: Report) -> Arranged:
    """Report modules that cannot be connected; return how they are."""
    tables = Tables.of(root)
    question = units_question(tables)
    answer = Arranged() if question is None else arrange(question)
    report_units(tables, answer.faults, report)
    return answer


def known_classes(root: Element) -> dict[str, ClassFacts]:
    """Return what the classes of a mission's types say of themselves; those of its own are imported elsewhere."""
    known = shipped_classes()
    paths = {one.text("class") for one in section(root, "types")}
    asked = [path for path in sorted(paths - known.keys()) if CLASS_PATH.fullmatch(path) and not class_path_fault(path)]
    return {**known, **ask_classes(asked)}
