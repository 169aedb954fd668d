"""The schema, the code and the reference say the same."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

from backbone.component_database.messages import Multiplicity
from backbone.mission.reader import schema_text
from backbone.mission.schema import enumerations, vocabulary
from backbone.naming import Subsystem, is_legal

HERE = Path(__file__).parent
REFERENCE = HERE.parents[2] / "docs" / "reference" / "mission-file.md"
SCHEMA = etree.XMLSchema(etree.fromstring(schema_text().encode()))


def is_host_name_of_the_schema(name: str) -> bool:
    return bool(SCHEMA.validate(etree.Element("host", {"name": name, "address": "127.0.0.1"})))


def test_every_element_and_attribute_is_documented_in_the_schema() -> None:
    for tag, rule in vocabulary().items():
        assert rule.documentation.endswith("."), tag
        for name, attribute in rule.attributes.items():
            assert attribute.documentation.endswith("."), (tag, name)


def test_the_reference_has_a_section_for_every_element_with_all_its_attributes() -> None:
    sections = {part.partition("\n")[0]: part for part in REFERENCE.read_text().split("\n### ")[1:]}
    assert list(sections) == [f"`<{tag}>`" for tag in vocabulary()]
    for tag, rule in vocabulary().items():
        section = sections[f"`<{tag}>`"]
        assert rule.documentation in section, tag
        for name, attribute in rule.attributes.items():
            given = "required" if attribute.required else f"`{attribute.default}`" if attribute.default else "–"
            assert f"| `{name}` | {given} | {attribute.documentation} |" in section, (tag, name)
        for child in rule.children:
            assert f"`<{child}>`" in section, (tag, child)


def test_the_schemas_lists_of_values_are_those_of_the_code() -> None:
    assert enumerations()["subsystem"] == list(Subsystem)
    assert enumerations()["multiplicity"] == list(Multiplicity)


@given(st.text("ab1_-. A\u00e4", max_size=6) | st.from_regex(r"\A[a-z][a-z0-9_-]{55,70}\Z"))
def test_a_name_is_legal_in_the_schema_exactly_if_it_is_in_the_code(name: str) -> None:
    assert is_host_name_of_the_schema(name) == is_legal(name)


@pytest.mark.parametrize("file", [HERE / "small.xml", HERE.parents[2] / "mission.xml"], ids=["small", "mission"])
def test_other_tools_that_use_the_schema_accept_good_files(file: Path) -> None:
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False)
    assert SCHEMA.validate(etree.parse(file, parser)), SCHEMA.error_log
