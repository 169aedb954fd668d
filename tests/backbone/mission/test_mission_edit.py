"""A mission file's text is changed where it is meant and nowhere else."""

from __future__ import annotations

import re
from pathlib import Path as FilePath

import pytest
from examples import share
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from backbone.mission.declaration.vocabulary import vocabulary
from backbone.mission.document import MAX_BYTES
from backbone.mission.edit import EditRefused, Element, NewElement, add, move, outline, remove, set_attribute
from backbone.mission.reader import MissionInvalid

MISSION = (FilePath(__file__).parent / "everything_declared.xml").read_bytes()
SMALL = b"""<?xml version="1.0"?>
<!-- before -->
<mission name="m" priority="1">
\t<!-- of the hosts -->
\t<hosts>
\t\t<host name='a' address="1.1.1.1"/> <!-- the first -->
\t\t<!-- between -->
\t\t<host name="b" address="2 > 1 &amp; 'x'"
\t\t      tags="gl"/>
\t</hosts>
\t<resources/>

\t<behaviors>
\t\t<behavior type="t" name="p" priority="1"><behavior type="t" name="q" priority="1"/></behavior>
\t\t<behavior type="t" name="r" priority="1">
\t\t\t<!-- of the parameter:
\t\t\t     two lines -->
\t\t\t<parameter name="v" value="1
\t\t\t2"/>
\t\t</behavior>
\t</behaviors>
</mission>
<!-- after -->
"""
COMMENT = re.compile(rb"<!--.*?-->", re.DOTALL)
Tree = list  # [tag, attributes, children], as a person would keep book


def tree(node: Element) -> Tree:
    return [node.tag, dict(node.values), [tree(child) for child in node.children]]


def at(root: Tree, path: tuple[int, ...]) -> Tree:
    for number in path:
        root = root[2][number]
    return root


def comments(data: bytes) -> list[bytes]:
    """Return all comments; how far their lines are indented does not count."""
    return sorted(b" ".join(comment.split()) for comment in COMMENT.findall(data))


TEXTS = st.sampled_from([MISSION, SMALL, SMALL.replace(b"\n", b"\r\n"), b"\xef\xbb\xbf" + SMALL])
VALUES = st.text(st.characters(codec="utf-8", exclude_categories=["Cs", "Cc"]), max_size=8) | st.sampled_from(
    ["\"'<>&", "a\nb\tc\rd", "]]>", "--", "ü" * 40]
)


@settings(max_examples=share(40), suppress_health_check=[HealthCheck.too_slow])
@given(TEXTS, st.data())
def test_any_sequence_of_changes_does_to_the_text_what_it_does_to_a_tree(text: bytes, data: st.DataObject) -> None:
    """What is read afterwards is what was meant, comments stand as they stood, the layout is never read."""
    expected = tree(outline(text))
    for _ in range(data.draw(st.integers(1, 5))):
        root = outline(text)
        node = data.draw(st.sampled_from(list(root)))
        before = comments(text)
        match data.draw(st.sampled_from(["set", "clear", "add", "remove", "move"])):
            case "set" | "clear" as what:
                names = list(vocabulary()[node.tag].attributes)
                if not names:
                    continue
                name = data.draw(st.sampled_from(names))
                value = data.draw(VALUES) if what == "set" else None
                text = set_attribute(text, node.path, name, value)
                at(expected, node.path)[1].pop(name, None)
                if value is not None:
                    at(expected, node.path)[1][name] = value
                assert comments(text) == before
            case "add":
                tags = [tag for tag, (_, most) in vocabulary()[node.tag].children.items() if len(node.all(tag)) < most]
                if not tags:
                    continue
                tag, number = data.draw(st.sampled_from(tags)), data.draw(st.integers(0, len(node.children)))
                values = {name: data.draw(VALUES) for name in list(vocabulary()[tag].attributes)[:2]}
                text = add(text, node.path, NewElement(tag, values), number)
                at(expected, node.path)[2].insert(number, [tag, values, []])
                assert comments(text) == before
            case "remove":
                if not node.path:
                    continue
                inside = comments(text[node.span.begin : node.span.end])
                text = remove(text, node.path)
                at(expected, node.path[:-1])[2].pop(node.path[-1])
                assert comments(text) == sorted(rest(before, inside))
            case "move":
                parents = [
                    other
                    for other in root
                    if node.path
                    and other.path[: len(node.path)] != node.path
                    and node.tag in vocabulary()[other.tag].children
                    and (
                        other.path == node.path[:-1]
                        or len(other.all(node.tag)) < vocabulary()[other.tag].children[node.tag][1]
                    )
                ]
                if not parents:
                    continue
                target = data.draw(st.sampled_from(parents))
                new_parent = at(expected, target.path)
                moved = at(expected, node.path[:-1])[2].pop(node.path[-1])
                number = data.draw(st.integers(0, len(new_parent[2])))
                text = move(text, node.path, target.path, number)
                new_parent[2].insert(number, moved)
                assert comments(text) == before
        assert tree(outline(text)) == expected


def rest(all_of: list[bytes], taken: list[bytes]) -> list[bytes]:
    left = list(all_of)
    for one in taken:
        left.remove(one)
    return left


@settings(max_examples=share(30))
@given(TEXTS, st.data())
def test_what_is_added_and_removed_again_leaves_no_trace(text: bytes, data: st.DataObject) -> None:
    root = outline(text)
    parents = [node for node in root if node.children and vocabulary()[node.tag].children]
    node = data.draw(st.sampled_from([node for node in parents if node.tag != "mission"]))
    tags = [tag for tag, (_, most) in vocabulary()[node.tag].children.items() if len(node.all(tag)) < most]
    number = data.draw(st.integers(0, len(node.children)))
    more = add(text, node.path, NewElement(data.draw(st.sampled_from(tags))), number)
    again = remove(more, (*node.path, number))
    assert b" ".join(again.split()) == b" ".join(text.split())
    if node.place.line != node.children[0].place.line:
        assert again == text


@given(st.binary(max_size=60))
def test_what_is_no_xml_is_refused_as_the_reader_refuses_it(data: bytes) -> None:
    with pytest.raises(MissionInvalid):
        outline(data)


def test_a_value_changes_between_its_own_quotes_and_nothing_else() -> None:
    text = set_attribute(SMALL, (0, 0), "name", 'it\'s <a> "b"')
    assert text == SMALL.replace(b"name='a'", b"name='it&apos;s &lt;a> \"b\"'")
    assert set_attribute(text, (0, 0), "name", "a") == SMALL


def test_a_new_attribute_stands_where_the_schema_has_it() -> None:
    text = set_attribute(MISSION, (5, 0, 0, 0), "maximum-runtime-s", "8")
    assert b'<arc kind="capture" minimum-runtime-s="5" maximum-runtime-s="8" period-s="0.1"' in text
    assert set_attribute(text, (5, 0, 0, 0), "maximum-runtime-s", None) == MISSION


def test_an_attribute_that_makes_the_line_too_long_gets_one_of_its_own() -> None:
    text = set_attribute(MISSION, (3, 0), "features", "some more features that this radio is said to have")
    added = text[len(MISSION.partition(b'driver="simulated"')[0]) :]
    assert b'driver="simulated"\n              features="some more' in added
    assert all(len(line) <= 130 for line in text.splitlines())


def test_what_is_added_is_written_as_its_neighbors_are() -> None:
    text = add(SMALL, (0,), NewElement("host", {"address": "3.3.3.3", "name": "c"}), 1)
    expected = b'<!-- the first -->\n\t\t<host name="c" address="3.3.3.3"/>\n\t\t<!-- between -->'
    assert expected in text


def test_an_empty_section_is_opened_and_closed_again() -> None:
    text = add(SMALL, (1,), NewElement("resource", {"type": "x", "name": "y"}))
    assert b'\t<resources>\n\t  <resource type="x" name="y"/>\n\t</resources>\n' in text
    assert remove(text, (1, 0)) == SMALL


def test_a_long_tag_gets_a_second_line_of_attributes() -> None:
    long = {"name": "n" * 40, "class": "package.module:Class" + "x" * 20, "subsystem": "mission_control"}
    text = add(MISSION, (2,), NewElement("type", long)).decode()
    lines = text.splitlines()
    (first,) = [number for number, line in enumerate(lines) if "n" * 40 in line]
    assert lines[first].startswith("    <type name=")
    assert lines[first + 1] == '          subsystem="mission_control"/>'


def test_a_section_is_set_apart_where_sections_are() -> None:
    text = remove(MISSION, (5,))
    assert b"<behaviors>\n\n  " not in add(text, (), NewElement("behaviors"))
    assert b"</world>\n\n  <behaviors/>\n" in add(text, (), NewElement("behaviors"))


def test_an_element_that_moves_is_indented_anew_with_all_in_it() -> None:
    text = move(MISSION, (5, 0, 1), (5, 0, 0), 9).decode()
    assert (
        """        </arc>
        <behavior type="watch_for_motion" name="watch-scout2" priority="1">
          <arc kind="capture" minimum-runtime-s="5" period-s="0.1" packet-time-s="0.002">
            <wish type="scout" name="scout2"/>
          </arc>
        </behavior>
      </behavior>
    </behavior>
"""
        in text
    )
    assert move(text.encode(), (5, 0, 0, 1), (5, 0), 1) == MISSION


def test_line_breaks_inside_a_value_do_not_move_with_it() -> None:
    text = move(SMALL, (2, 1), (2,), 0)
    deeper = move(text, (2, 0), (2, 1), 0)
    assert outline(deeper).at((2, 0, 0, 0)).values == outline(SMALL).at((2, 1, 0)).values
    assert b"of the parameter" in deeper


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda: add(SMALL, (0,), NewElement("behavior")), "<hosts> may contain: <host>"),
        (lambda: add(SMALL, (0, 0), NewElement("host")), "has no elements inside"),
        (lambda: add(SMALL, (), NewElement("hosts")), "has its <hosts> already"),
        (lambda: add(SMALL, (0,), NewElement("host", {"color": "red"})), "Its attributes: name, address, tags, port"),
        (lambda: add(SMALL, (0,), NewElement("host", {}, [NewElement("host")])), "does not belong"),
        (lambda: set_attribute(SMALL, (0,), "name", "x"), "no attribute"),
        (lambda: set_attribute(SMALL, (0, 0), "name", "\x00"), "is not allowed in XML"),
        (lambda: set_attribute(SMALL, (0, 0), "name", "\ud800"), "is not allowed in XML"),
        (lambda: set_attribute(SMALL, (0, 0), "name", "x" * MAX_BYTES), "Split the mission"),
        (lambda: set_attribute(SMALL, (9, 9), "name", "x"), "no element stands at 9/9"),
        (lambda: remove(SMALL, ()), "cannot be removed"),
        (lambda: move(SMALL, (2, 0), (2, 0, 0), 0), "into itself"),
        (lambda: move(SMALL, (2, 0), (0,), 0), "does not belong"),
    ],
)
def test_what_cannot_be_written_is_refused_with_a_remedy(change, told: str) -> None:
    with pytest.raises(EditRefused, match=re.escape(told)) as refused:
        change()
    assert refused.value.remedy


def test_nothing_grows_deeper_than_the_reader_reads() -> None:
    new = NewElement("behavior", {"name": "x"})
    text, path = add(SMALL, (2,), new, 0), (2, 0)
    for _ in range(29):
        text, path = add(text, path, new, 0), (*path, 0)
    with pytest.raises(EditRefused, match="nested deeper"):
        add(text, path, new, 0)
