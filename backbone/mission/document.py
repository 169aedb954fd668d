"""A mission file as elements with their places in the file.

One parser reads the file: expat, which knows the byte at which each tag begins. Validation, checks and editing use its
elements, so they cannot read the same bytes differently.

Rules of this file:

* A document type declaration is refused. Without one there are no entities that could grow or fetch anything.
* The size is checked before reading, the depth while reading, so that a hostile file costs little time and memory.
"""

from __future__ import annotations

import bisect
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import NamedTuple
from xml.parsers import expat

from backbone.errors import Refusal
from backbone.mission.declaration.values import decimal, flag
from backbone.mission.report import MissionInvalid, Place, Report, quoted

MAX_BYTES = 1024 * 1024  # chosen: a robot with its behavior is 600 bytes, so this is more than a thousand robots
MAX_ELEMENTS = 20_000  # chosen: same; a robot with its behavior is 10 elements
MAX_DEPTH = 32  # chosen: the behavior tree of RAM 2002 is 3 deep
BEGINNING = Place(1, 1)

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_TAG = re.compile(rb"""<(?:[^>"']|"[^"]*"|'[^']*')*>""")
_ATTRIBUTE = re.compile(rb"""(\s+)([^\s=<>"'/]+)\s*=\s*("[^"]*"|'[^']*')""")


Path = tuple[int, ...]
"""Path from the root to an element: at each level its number among its siblings, from 0; empty for the root itself."""


class EditRefused(Refusal):
    """A mission file cannot be changed so; the text is unchanged."""

    code = "mission.edit"
    remedy = "Look at the tree: docs/reference/mission-file.md lists the place of each element."


@dataclass(slots=True)
class Attribute:
    """A value and its place.

    Attributes:
        place: Place of its name.
        is_written: False if the file leaves it out, and this is its default.
    """

    value: str
    place: Place
    is_written: bool = True


class Span(NamedTuple):
    """Span of an element among the bytes of its file.

    Attributes:
        begin: First byte of its tag.
        content: First byte after its tag.
        close: First byte of its end tag; equal to ``content`` if it has none.
        end: First byte after the element.
    """

    begin: int
    content: int
    close: int
    end: int


NOWHERE = Span(0, 0, 0, 0)  # of an element that no file holds


@dataclass(slots=True)
class Element:
    """An element and its place.

    The reading methods never fail: if a value is missing or illegal, they return an empty one, and the validation
    reports the fault.

    Attributes:
        path: Its path among the elements of its file.
    """

    tag: str
    place: Place
    attributes: dict[str, Attribute] = field(default_factory=dict)
    children: list[Element] = field(default_factory=list)
    span: Span = NOWHERE
    path: Path = ()

    @property
    def values(self) -> dict[str, str]:
        """Its attributes in the order of the text."""
        return {name: attribute.value for name, attribute in self.attributes.items()}

    def __iter__(self) -> Iterator[Element]:
        """Yield this element and all its descendants, in the order of the file."""
        yield self
        for child in self.children:
            yield from child

    def placed(self, place: Place) -> Element:
        """Return a copy of this element and all its descendants, with all of it at this place."""
        attributes = {name: Attribute(one.value, place, one.is_written) for name, one in self.attributes.items()}
        children = [child.placed(place) for child in self.children]
        return Element(self.tag, place, attributes, children, self.span, self.path)

    def at(self, path: Path) -> Element:
        """Return the element at a path below this one.

        Raises:
            EditRefused: No element has this path.
        """
        element = self
        for number in path:
            if not 0 <= number < len(element.children):
                raise EditRefused(f"no element stands at {'/'.join(map(str, path))}", remedy="Pick another.")
            element = element.children[number]
        return element

    def nearest(self, path: Path) -> Path:
        """Return the longest part of the path that leads to an element."""
        element, depth = self, 0
        while depth < len(path) and path[depth] < len(element.children):
            element, depth = element.children[path[depth]], depth + 1
        return path[:depth]

    def all(self, tag: str) -> list[Element]:
        """Return the children with this tag."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> Element | None:
        """Return the first child with this tag, if there is one."""
        return next((child for child in self.children if child.tag == tag), None)

    def place_of(self, attribute: str) -> Place:
        """Return the place of the attribute, or of the element if it has no such attribute."""
        found = self.attributes.get(attribute)
        return self.place if found is None else found.place

    def has(self, attribute: str) -> bool:
        """Return whether the file gives this attribute."""
        found = self.attributes.get(attribute)
        return found is not None and found.is_written

    def text(self, attribute: str) -> str:
        """Return the value as written; empty if there is none."""
        found = self.attributes.get(attribute)
        return "" if found is None else found.value

    def words(self, attribute: str) -> list[str]:
        """Return the names in the value."""
        return self.text(attribute).split()

    def number(self, attribute: str) -> float | None:
        """Return the value as a number; None if it is not one."""
        return decimal(self.text(attribute))

    def flag(self, attribute: str) -> bool | None:
        """Return the value as true or false; None if it is neither."""
        return flag(self.text(attribute))


class AttributeSpan(NamedTuple):
    """Span of an attribute among the bytes of its file.

    Attributes:
        blanks: First byte of the blanks before it.
        name: First byte of its name.
        quote: First byte of its value, which is a quotation mark.
        end: First byte after it.
    """

    blanks: int
    name: int
    quote: int
    end: int


def attribute_spans(data: bytes, begin: int, content: int) -> dict[str, AttributeSpan]:
    """Return the spans of the attributes of a tag, by name.

    Args:
        data: A text that expat has read.
        begin: First byte of the tag.
        content: First byte after it.
    """
    return {
        match[2].decode(): AttributeSpan(match.start(1), match.start(2), match.start(3), match.end())
        for match in _ATTRIBUTE.finditer(data, begin, content)
    }


def read_bytes(path: FilePath, report: Report) -> bytes | None:
    """Return the content of the file; None, with a fault, if it cannot be a mission file."""
    try:
        if path.exists() and not path.is_file():
            report.fault(BEGINNING, "is no file", "Name a mission file.")
            return None
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        report.fault(BEGINNING, f"cannot be read: {reason}", "Name a mission file that this user may read.")
        return None
    if len(data) > MAX_BYTES:
        report.fault(BEGINNING, f"is larger than {MAX_BYTES} bytes", "Split the mission; no honest one is so large.")
        return None
    return data


def parse(data: bytes, report: Report) -> Element | None:
    """Return the root element; None, with a fault, if the bytes are not well-formed XML or are hostile."""
    lines = _Lines(data)
    try:
        data.decode()
        wrong = data.find(0)  # in UTF-16 without a mark, which expat would read as such
    except UnicodeDecodeError as error:
        wrong = error.start
    if wrong >= 0:
        report.fault(lines.place(wrong), f"byte 0x{data[wrong]:02x} is no UTF-8 text", "Save the file in UTF-8.")
        return None
    return _Parse(data, lines, report).root()


def outline(data: bytes) -> Element:
    """Return the root of a mission file's text as written, without defaults.

    Raises:
        MissionInvalid: The text is not well-formed XML, or is hostile; with the reader's faults.
    """
    report = Report("mission")
    root = parse(data, report)
    if root is None:
        raise MissionInvalid(report.faults())
    return root


def _first_byte(data: bytes) -> int:
    """Return the begin of the text, after a byte order mark."""
    return len(_BYTE_ORDER_MARK) if data.startswith(_BYTE_ORDER_MARK) else 0


class _Refused(Exception):
    """Raised inside expat's handlers to end the parse; its fault is in the report."""


class _Lines:
    """Converts a position in UTF-8 bytes to line and column."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._starts = [_first_byte(data), *(match.end() for match in re.finditer(b"\n", data))]

    def place(self, offset: int) -> Place:
        line = bisect.bisect_right(self._starts, offset)
        before = self._data[self._starts[line - 1] : offset]
        return Place(line, len(before.decode(errors="replace")) + 1)


class _Parse:
    """One run of expat over one file."""

    def __init__(self, data: bytes, lines: _Lines, report: Report) -> None:
        self._data, self._report, self._lines = data, report, lines
        self._first = _first_byte(data)
        self._open: list[Element] = []
        self._root: Element | None = None
        self._count = 0
        self._in_text = False
        self._parser = expat.ParserCreate("utf-8")
        self._parser.XmlDeclHandler = self._declaration
        self._parser.StartDoctypeDeclHandler = self._doctype
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._text

    def root(self) -> Element | None:
        try:
            self._parser.Parse(self._data[self._first :], True)
        except _Refused:
            return None
        except expat.ExpatError as error:
            where = Place(error.lineno, error.offset + 1)
            still_open = f"; <{self._open[-1].tag}> of line {self._open[-1].place.line} is open" if self._open else ""
            reason = expat.ErrorString(error.code)
            self._report.fault(
                where, f"not well-formed XML: {reason}{still_open}", "Mend the XML here, or just before."
            )
            return None
        return self._root

    def _at(self) -> int:
        return self._first + self._parser.CurrentByteIndex

    def _here(self) -> Place:
        return self._lines.place(self._at())

    def _declaration(self, _version: str, encoding: str | None, _standalone: int) -> None:
        if encoding is not None and encoding.lower() not in ("utf-8", "us-ascii"):
            self._report.fault(self._here(), f"is written in {encoding}", "Save the file in UTF-8 and say so here.")
            raise _Refused

    def _doctype(self, *_declared: object) -> None:
        begin = self._data.rfind(b"<!DOCTYPE", 0, self._at() + 1)
        self._report.fault(
            self._lines.place(begin),
            "a document type declaration",
            "Remove <!DOCTYPE …>; mission files have no entities.",
        )
        raise _Refused

    def _start(self, tag: str, values: dict[str, str]) -> None:
        begin = self._at()
        element = Element(tag, self._lines.place(begin))
        self._count += 1
        if len(self._open) == MAX_DEPTH:
            self._report.fault(element.place, f"elements are nested deeper than {MAX_DEPTH}", "Flatten the tree.")
            raise _Refused
        if self._count > MAX_ELEMENTS:
            self._report.fault(element.place, f"more than {MAX_ELEMENTS} elements", "Split the mission.")
            raise _Refused
        matched = _TAG.match(self._data, begin)
        if matched is None:
            raise AssertionError(f"expat found a tag at byte {begin}, where none begins")
        element.span = Span(begin, matched.end(), matched.end(), matched.end())
        spans = attribute_spans(self._data, begin, matched.end())
        element.attributes = {
            name: Attribute(value, self._lines.place(spans[name].name)) for name, value in values.items()
        }
        if self._open:
            parent = self._open[-1]
            element.path = (*parent.path, len(parent.children))
            parent.children.append(element)
        else:
            self._root = element
        self._open.append(element)
        self._in_text = False

    def _end(self, _tag: str) -> None:
        element = self._open.pop()
        begin, content, *_ = element.span
        if self._data[content - 2 : content] != b"/>":
            close = self._at()
            element.span = Span(begin, content, close, self._data.index(b">", close) + 1)
        self._in_text = False

    def _text(self, text: str) -> None:
        if self._in_text or not text.strip():  # expat hands text over in pieces
            return
        self._in_text = True
        blanks = len(text) - len(text.lstrip())
        place = Place(self._here().line, self._here().column + blanks)
        self._report.fault(
            place, f"text {quoted(text.strip())} between elements", "Remove it, or make it a <!-- comment -->."
        )
