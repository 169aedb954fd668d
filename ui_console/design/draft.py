"""A mission during its design: a text, its problems, its rehearsal, and the steps to undo.

Pure: a draft and a command go in, another draft comes out. The text is the only source: tree, problems and dry run are
read from it, so the page shows the mission that ``check`` and ``up`` will read. Undo restores the bytes.
"""

from __future__ import annotations

import bisect
import contextlib
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path as FilePath

from backbone.atomic_file import remove_leftover
from backbone.dry_run.run import DryRun, dry_run
from backbone.mission.class_facts import PLANNER, ClassFacts
from backbone.mission.document import read_bytes
from backbone.mission.edit import Element, Path, outline, set_attribute
from backbone.mission.model import MissionDescription
from backbone.mission.reader import Fault, MissionInvalid, read_mission_bytes
from backbone.mission.report import Report
from backbone.naming import is_legal
from ui_console.design.catalogue import new_text
from ui_console.design.commands import DesignCommand, NothingToUndo, TextState

UNDO_MOST = 1000  # chosen: more than one session; a mission file is small


@dataclass(frozen=True)
class Draft:
    """A mission being designed; immutable.

    Attributes:
        source: The mission file; need not exist yet.
        step: The present text.
        past: Earlier texts, the last one last.
        future: Undone texts, the next one last.
        saved: Last known content of the file; None: there is no file.
        classes: Facts of the classes of its own types, by which their parameters are checked.
    """

    source: str
    step: TextState
    past: tuple[TextState, ...] = ()
    future: tuple[TextState, ...] = ()
    saved: bytes | None = None
    classes: Mapping[str, ClassFacts] = field(default_factory=dict)

    @classmethod
    def new(cls, source: str) -> Draft:
        """Return a mission with a host and the core services, and no behaviors; named as its file if that is legal."""
        name = FilePath(source).stem.lower()
        text = set_attribute(new_text(), (), "name", name) if is_legal(name) else new_text()
        return cls(source, TextState(text))

    @classmethod
    def opened(cls, source: str) -> Draft:
        """Return the draft of a file's content with its problems; remove the remains of a killed save.

        Raises:
            MissionInvalid: The file cannot be read, or is not XML.
        """
        with contextlib.suppress(OSError):  # the file can be opened nevertheless
            remove_leftover(FilePath(os.path.realpath(source)))  # ``resolve`` raises on a loop of links
        report = Report(source)
        text = read_bytes(FilePath(source), report)
        if text is None:
            raise MissionInvalid(report.faults())
        try:
            outline(text)
        except MissionInvalid as invalid:
            raise MissionInvalid(
                Fault(source, fault.line, fault.column, fault.message, fault.remedy) for fault in invalid.faults
            ) from None
        return cls(source, TextState(text), saved=text)

    @property
    def text(self) -> bytes:
        """The bytes of the file."""
        return self.step.text

    @property
    def is_changed(self) -> bool:
        """Whether the text differs from the file."""
        return self.text != self.saved

    @cached_property
    def mission(self) -> Element:
        """The tree of the text."""
        return outline(self.text)

    @cached_property
    def _read(self) -> MissionDescription | tuple[Fault, ...]:
        try:
            return read_mission_bytes(self.text, self.source, self.classes)
        except MissionInvalid as invalid:
            return invalid.faults

    @property
    def problems(self) -> tuple[Fault, ...]:
        """The faults that ``scout-backbone check`` reports without running code of one's own; empty: no fault."""
        return self._read if isinstance(self._read, tuple) else ()

    @property
    def description(self) -> MissionDescription | None:
        """The mission of the text; None while it has problems."""
        return None if isinstance(self._read, tuple) else self._read

    @cached_property
    def rehearsal(self) -> DryRun | None:
        """The first minute of its schedule; None while it has problems or names a planner, which would run here."""
        if self.description is None or self.description.core_parameters("rc_manager").get(PLANNER):
            return None
        return dry_run(self.description)

    def do(self, command: DesignCommand) -> Draft:
        """Return the draft after a command; if it changes nothing, return the same draft.

        Raises:
            Refusal: ``DesignRefused``, ``EditRefused`` or ``IllegalName``: the command is not possible.
        """
        return self._after(command.carry_out(self.text))

    def taken_from(self, text: bytes) -> Draft:
        """Return the draft with the file's present content; undo restores the previous text.

        Raises:
            MissionInvalid: The text is not XML.
        """
        outline(text)
        return replace(self._after(TextState(text)), saved=text)

    def _after(self, step: TextState) -> Draft:
        if step.text == self.text:
            return self
        return replace(self, step=step, past=(*self.past, self.step)[-UNDO_MOST:], future=())

    def undo(self) -> Draft:
        """Return the draft before its last command.

        Raises:
            NothingToUndo: There is none.
        """
        if not self.past:
            raise NothingToUndo("there is nothing to undo")
        return replace(self, step=self.past[-1], past=self.past[:-1], future=(*self.future, self.step))

    def redo(self) -> Draft:
        """Return the draft after the command undone last.

        Raises:
            NothingToUndo: There is none.
        """
        if not self.future:
            raise NothingToUndo("there is nothing to do again")
        return replace(self, step=self.future[-1], past=(*self.past, self.step), future=self.future[:-1])

    def knowing(self, classes: Mapping[str, ClassFacts]) -> Draft:
        """Return the same draft, with parameters checked by the facts of these classes."""
        return replace(self, classes=classes)

    def kept(self, source: str) -> Draft:
        """Return the same draft, saved at this path."""
        return replace(self, source=source, saved=self.text)

    def element_of(self, fault: Fault) -> Path:
        """Return the element of a problem: the last element that begins before the problem's place."""
        before = bisect.bisect_right(self._elements, (fault.line, fault.column), key=lambda element: element.place)
        return self._elements[max(0, before - 1)].path

    @cached_property
    def _elements(self) -> list[Element]:
        """All elements in the order of the text."""
        return list(self.mission)
