"""A mission file's text as a tree of elements, each with the bytes it takes: what editing works on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from backbone.errors import Refusal
from backbone.mission.document import Element, parse
from backbone.mission.report import MissionInvalid, Report

Path = tuple[int, ...]
"""Path of an element: its number among its parent's children, from 0, from the root down; the root's is empty."""


class EditRefused(Refusal):
    """A change of a mission file that cannot be made; the text is as it was."""

    code = "mission.edit"
    remedy = "Look at the tree: docs/reference/mission-file.md lists the place of each element."


@dataclass(frozen=True, slots=True)
class Node:
    """An element of the text, as it is written: nothing is filled in.

    Attributes:
        path: Where it stands.
        tag: Its tag.
        attributes: Its attributes in the order of the text.
        line: Line of its tag, from 1.
        begin: First byte of its tag.
        content: First byte behind its tag.
        close: First byte of its end tag; the same as ``content`` if it has none.
        end: First byte behind it.
        is_empty: Whether it is written ``<tag/>``.
    """

    path: Path
    tag: str
    attributes: dict[str, str]
    children: tuple[Node, ...]
    line: int
    begin: int
    content: int
    close: int
    end: int
    is_empty: bool

    def __iter__(self) -> Iterator[Node]:
        """Yield this element and all below it, in the order of the text."""
        yield self
        for child in self.children:
            yield from child

    def at(self, path: Path) -> Node:
        """Return the element at a path.

        Raises:
            EditRefused: There is none.
        """
        node = self
        for number in path:
            if not 0 <= number < len(node.children):
                raise EditRefused(f"no element stands at {'/'.join(map(str, path))}", remedy="Pick another.")
            node = node.children[number]
        return node

    def nearest(self, path: Path) -> Path:
        """Return the path as far down as elements stand there."""
        node, depth = self, 0
        while depth < len(path) and path[depth] < len(node.children):
            node, depth = node.children[path[depth]], depth + 1
        return path[:depth]

    def all(self, tag: str) -> list[Node]:
        """Return the children of this tag."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> Node | None:
        """Return the first child of this tag, if there is one."""
        return next((child for child in self.children if child.tag == tag), None)

    def text(self, attribute: str) -> str:
        """Return the value as it is written, empty if there is none."""
        return self.attributes.get(attribute, "")


def outline(data: bytes) -> Node:
    """Return the root of a mission file's text.

    Raises:
        MissionInvalid: It is not well-formed XML, or is hostile; with the reader's faults.
    """
    report = Report("mission")
    root = parse(data, report)
    if root is None:
        raise MissionInvalid(report.faults())
    return _node(root, ())


def _node(element: Element, path: Path) -> Node:
    return Node(
        path,
        element.tag,
        {name: attribute.value for name, attribute in element.attributes.items()},
        tuple(_node(child, (*path, number)) for number, child in enumerate(element.children)),
        element.place.line,
        *element.span,
        is_empty=element.span.content == element.span.end,
    )
