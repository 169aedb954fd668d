"""Changes of a mission file's text, each only at its own place.

Pure: bytes in, bytes out. Comments, order and layout of all else stay unchanged. Added elements have the usual layout:
one element a line, indented like its neighbors, attributes in the declared order.

Rules of this file:

* The places of elements are those that the reader found.
* A change is made in the text, which is then read again. If the new text cannot be read, the change is refused.
* This file refuses only what cannot be written. The reader checks whether names and values fit.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from backbone.mission.declaration.vocabulary import vocabulary
from backbone.mission.document import MAX_BYTES, EditRefused, Element, Path, attribute_spans, outline, parse
from backbone.mission.report import Report, listed, quoted

__all__ = [
    "EditRefused",
    "Element",
    "NewElement",
    "Path",
    "add",
    "insert",
    "move",
    "outline",
    "place_for",
    "remove",
    "set_attribute",
]

LINE_LENGTH = 120  # chosen: as mission.xml; longer tags get a second line of attributes
STEP = "  "  # the indentation of an element without a neighbor

_WHOLE = re.compile(rb"""<!--.*?-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>|<(?:[^>"']|"[^"]*"|'[^']*')*>""", re.DOTALL)
_QUOTED = re.compile(rb"""("[^"]*"|'[^']*')""")
_NOT_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_LINE_END_COMMENT = re.compile(rb"[ \t]*<!--(?:(?!-->)[^\n])*-->(?=[ \t]*(?:\r?\n|$))")


@dataclass(frozen=True, slots=True)
class NewElement:
    """An element to be added.

    Attributes:
        attributes: Its attributes; they are written in the declared order.
        children: Elements in it, in this order.
    """

    tag: str
    attributes: Mapping[str, str] = field(default_factory=dict)
    children: Sequence[NewElement] = ()


def set_attribute(data: bytes, path: Path, name: str, value: str | None) -> bytes:
    """Return the text with another value; its quotes stay, and a new attribute gets its place in the declared order.

    Args:
        value: The new value; None: the attribute is removed.

    Raises:
        EditRefused: The element does not exist, cannot have the attribute, or the value cannot be written in XML.
    """
    node = outline(data).at(path)
    _may_have(node.tag, name)
    spans = attribute_spans(data, node.span.begin, node.span.content)
    if value is None:
        if name not in spans:
            return data
        return _readable(data[: spans[name].blanks] + data[spans[name].end :])
    if name in spans:
        begin = spans[name].quote
        quote = data[begin : begin + 1].decode()
        return _readable(data[:begin] + _quoted(value, quote) + data[spans[name].end :])
    order = list(vocabulary()[node.tag].attributes)
    before = [span.end for other, span in spans.items() if other in order[: order.index(name)]]
    head = node.span.begin + 1 + len(node.tag.encode())
    at = max(before, default=head)
    text = f"{name}=".encode() + _quoted(value)
    blank = b" "
    line_begin, line_end = data.rfind(b"\n", 0, at) + 1, data.find(b"\n", at)
    if spans and len(data[line_begin:line_end].rstrip().decode()) + 1 + len(text.decode()) > LINE_LENGTH:
        blank = _newline(data) + _indent(data, node.span.begin).encode() + b" " * (len(node.tag) + 2)
    return _readable(data[:at] + blank + text + data[at:])


def add(data: bytes, parent: Path, new: NewElement, at: int | None = None) -> bytes:
    """Return the text with one more element, on lines of its own if its neighbors have lines of their own.

    Args:
        at: Its number among its siblings afterwards; None: after those of its tag, in the declared order of tags.

    Raises:
        EditRefused: The parent cannot have it.
    """
    root = outline(data)
    node = root.at(parent)
    _may_hold(node, new.tag)
    _may_be(new)
    number = place_for(node, new.tag, at)
    indent = _indent_of_children(data, node)
    lines = _written(new, indent)
    return _insert(data, node, number, lines, apart=parent == () and _stands_apart(data, node))


def insert(data: bytes, parent: Path, other: bytes, at: int) -> bytes:
    """Return the text with the root of another text inserted unchanged, with the comments in it.

    Args:
        at: Its number among its siblings afterwards.

    Raises:
        EditRefused: The parent cannot have it.
        MissionInvalid: The other text cannot be read.
    """
    node, new = outline(data).at(parent), outline(other)
    _may_hold(node, new.tag)
    text = _indented(
        other[new.span.begin : new.span.end], _indent(other, new.span.begin), _indent_of_children(data, node)
    )
    return _insert(data, node, min(max(at, 0), len(node.children)), text)


def place_for(parent: Element, tag: str, at: int | None = None) -> int:
    """Return the number a new child would have among its siblings.

    Args:
        at: The wanted number; None: after the last of its tag, else after the tags that come before it by declaration.
    """
    if at is not None:
        return min(max(at, 0), len(parent.children))
    order = list(vocabulary()[parent.tag].children)
    same = [number for number, child in enumerate(parent.children) if child.tag == tag]
    if same:
        return same[-1] + 1
    earlier = set(order[: order.index(tag)])
    before = [number for number, child in enumerate(parent.children) if child.tag in earlier]
    return before[-1] + 1 if before else 0


def remove(data: bytes, path: Path) -> bytes:
    """Return the text without an element, its content, and the lines that only it occupied.

    Raises:
        EditRefused: The element does not exist, or is the root.
    """
    if not path:
        raise EditRefused("the mission itself cannot be removed", remedy="Begin another file.")
    root = outline(data)
    return _readable(_cut(data, root.at(path), root.at(path[:-1])))


def move(data: bytes, path: Path, parent: Path, at: int) -> bytes:
    """Return the text with an element moved, including its content and the comments in it.

    Args:
        parent: Path of its new parent before the change.
        at: Its number among its siblings afterwards.

    Raises:
        EditRefused: The new parent cannot have it.
    """
    root = outline(data)
    node, target = root.at(path), root.at(parent)
    if not path or parent[: len(path)] == path:
        raise EditRefused(f"<{node.tag}> cannot be moved into itself", remedy="Pick another place.")
    if parent != path[:-1]:
        _may_hold(target, node.tag)
    depth = len(path) - 1
    cut = _cut(data, node, root.at(path[:-1]))
    if len(parent) > depth and parent[:depth] == path[:-1] and parent[depth] > path[-1]:
        parent = (*parent[:depth], parent[depth] - 1, *parent[depth + 1 :])
    after = outline(cut).at(parent)
    old_indent, new_indent = _indent(data, node.span.begin), _indent_of_children(cut, after)
    text = _indented(data[node.span.begin : node.span.end], old_indent, new_indent)
    return _insert(cut, after, min(max(at, 0), len(after.children)), text)


def _may_have(tag: str, name: str) -> None:
    rule = vocabulary().get(tag)
    if rule is None or name not in rule.attributes:
        known = listed(rule.attributes) if rule is not None else ""
        raise EditRefused(
            f"<{tag}> has no attribute {quoted(name)}", remedy=f"Its attributes: {known}" if known else "It has none."
        )


def _may_hold(node: Element, tag: str) -> None:
    rule = vocabulary().get(node.tag)
    allowed = {} if rule is None else rule.children
    if tag not in allowed:
        there = listed([f"<{one}>" for one in allowed])
        raise EditRefused(
            f"<{tag}> does not belong in <{node.tag}>",
            remedy=f"<{node.tag}> may contain: {there}" if there else f"<{node.tag}> has no elements inside.",
        )
    if len(node.all(tag)) >= allowed[tag][1]:
        raise EditRefused(f"<{node.tag}> has its <{tag}> already", remedy="Change that one, or remove it first.")


def _may_be(new: NewElement) -> None:
    for name in new.attributes:
        _may_have(new.tag, name)
    allowed = vocabulary()[new.tag].children
    for child in new.children:
        if child.tag not in allowed:
            raise EditRefused(f"<{child.tag}> does not belong in <{new.tag}>")
        _may_be(child)


def _quoted(value: str, quote: str = '"') -> bytes:
    if strange := _NOT_XML.search(value):
        raise EditRefused(f"the character {strange[0]!r} is not allowed in XML", remedy="Leave it out.")
    escaped = value.replace("&", "&amp;").replace("<", "&lt;").replace("\r", "&#13;")
    escaped = escaped.replace("\n", "&#10;").replace("\t", "&#9;")
    escaped = escaped.replace('"', "&quot;") if quote == '"' else escaped.replace("'", "&apos;")
    return f"{quote}{escaped}{quote}".encode()


def _readable(data: bytes) -> bytes:
    """Return the text if the reader can still read it."""
    if len(data) > MAX_BYTES:
        raise EditRefused(f"the file would be larger than {MAX_BYTES} bytes", remedy="Split the mission.")
    report = Report("mission")
    if parse(data, report) is None:
        fault = report.faults()[0]
        raise EditRefused(f"the file could not be read any more: {fault.message}", remedy=fault.remedy)
    return data


def _written(new: NewElement, indent: str) -> bytes:
    """Return the element as lines, without the first indentation and the last line end."""
    order = {name: number for number, name in enumerate(vocabulary()[new.tag].attributes)}
    values = [
        f"{name}={_quoted(value).decode()}"
        for name, value in sorted(new.attributes.items(), key=lambda item: order[item[0]])
    ]
    head = f"<{new.tag}"
    close = ">" if new.children else "/>"
    lines, length = [head], len(indent) + len(head)
    for value in values:
        if length + 1 + len(value) + len(close) > LINE_LENGTH and lines[-1] != head:
            lines.append(indent + " " * len(head) + " " + value)
            length = len(lines[-1])
        else:
            lines[-1] += f" {value}"
            length += 1 + len(value)
    lines[-1] += close
    lines += [indent + STEP + _written(child, indent + STEP).decode() for child in new.children]
    if new.children:
        lines.append(f"{indent}</{new.tag}>")
    return "\n".join(lines).encode()


def _insert(data: bytes, parent: Element, number: int, text: bytes, *, apart: bool = False) -> bytes:
    """Return the data with a text in the parent, before its child of this number."""
    newline = _newline(data)
    text = re.sub(rb"\r?\n", newline, text)
    own_indent, indent = _indent(data, parent.span.begin).encode(), _indent_of_children(data, parent).encode()
    if not parent.children and not data[parent.span.content : parent.span.close].strip():
        inside = newline + indent + text + newline + own_indent
        if parent.span.content == parent.span.end:
            head = data[parent.span.begin : parent.span.content - 2].rstrip()
            tail = data[parent.span.end :]
            return _readable(data[: parent.span.begin] + head + b">" + inside + f"</{parent.tag}>".encode() + tail)
        return _readable(data[: parent.span.content] + inside + data[parent.span.close :])
    gap = newline * 2 if apart else newline
    if not parent.children:
        at = len(data[: parent.span.close].rstrip())
        return _readable(data[:at] + gap + indent + text + data[at:])
    if number > 0:
        before = parent.children[number - 1]
        if not _is_first_in_line(data, before.span.begin):
            return _readable(data[: before.span.end] + text + data[before.span.end :])
        at = _behind(data, before)
        return _readable(data[:at] + gap + indent + text + data[at:])
    first = parent.children[0]
    if _is_first_in_line(data, first.span.begin):
        start = data.rfind(b"\n", 0, first.span.begin) + 1
        return _readable(data[:start] + indent + text + gap + data[start:])
    return _readable(data[: first.span.begin] + text + data[first.span.begin :])


def _behind(data: bytes, node: Element) -> int:
    """Return the end of the element, including a comment that ends its line."""
    comment = _LINE_END_COMMENT.match(data, node.span.end)
    return comment.end() if comment else node.span.end


def _cut(data: bytes, node: Element, parent: Element) -> bytes:
    begin, end = node.span.begin, node.span.end
    rest = re.compile(rb"[ \t]*(\r?\n)").match(data, end)
    if _is_first_in_line(data, begin) and rest:
        begin, end = data.rfind(b"\n", 0, begin) + 1, rest.end()
        blank = re.compile(rb"[ \t]*\r?\n").match(data, end)
        if blank and re.search(rb"(?:^|\n)[ \t]*\r?\n\Z", data[:begin]):
            end = blank.end()
    left, right = data[:begin], data[end:]
    inside = data[parent.span.content : begin] + data[end : parent.span.close]
    if inside.strip():
        return left + right
    head = data[parent.span.begin : parent.span.content - 1].rstrip()
    return data[: parent.span.begin] + head + b"/>" + data[parent.span.end :]


def _newline(data: bytes) -> bytes:
    return b"\r\n" if b"\r\n" in data else b"\n"


def _is_first_in_line(data: bytes, at: int) -> bool:
    return not data[data.rfind(b"\n", 0, at) + 1 : at].strip()


def _indent(data: bytes, at: int) -> str:
    line = data[data.rfind(b"\n", 0, at) + 1 : at]
    return line[: len(line) - len(line.lstrip())].decode()


def _indent_of_children(data: bytes, node: Element) -> str:
    for child in node.children:
        if _is_first_in_line(data, child.span.begin):
            return _indent(data, child.span.begin)
    return _indent(data, node.span.begin) + STEP


def _indented(text: bytes, old: str, new: str) -> bytes:
    """Return an element with another indentation; line breaks inside values stay as they are."""
    if old == new:
        return text
    parts: list[bytes] = []
    at = 0
    for whole in _WHOLE.finditer(text):
        parts.append(_shifted(text[at : whole.start()], old, new))
        if whole[0].startswith((b"<![CDATA[", b"<?")):
            parts.append(whole[0])
        elif whole[0].startswith(b"<!--"):
            parts.append(_shifted(whole[0], old, new))
        else:
            pieces = _QUOTED.split(whole[0])
            parts += [piece if number % 2 else _shifted(piece, old, new) for number, piece in enumerate(pieces)]
        at = whole.end()
    parts.append(_shifted(text[at:], old, new))
    return b"".join(parts)


def _shifted(text: bytes, old: str, new: str) -> bytes:
    return re.sub(rb"\n" + re.escape(old.encode()) + rb"(?!\r?\n)", b"\n" + new.encode(), text)


def _stands_apart(data: bytes, node: Element) -> bool:
    """Return whether there is an empty line between the children."""
    return bool(re.search(rb"\n[ \t]*\r?\n", data[node.span.content : node.span.close]))
