"""The schema, the code and the reference say the same."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree
from pydantic import TypeAdapter, ValidationError

from backbone.mission.declaration import values
from backbone.mission.declaration.vocabulary import vocabulary
from backbone.mission.declaration.xsd import xsd_text
from backbone.naming import is_legal

HERE = Path(__file__).parent
SCHEMA = etree.XMLSchema(etree.fromstring(xsd_text().encode()))


def is_host_name_of_the_schema(name: str) -> bool:
    return bool(SCHEMA.validate(etree.Element("host", {"name": name, "address": "127.0.0.1"})))


def test_every_element_and_attribute_is_documented_in_the_schema() -> None:
    for tag, rule in vocabulary().items():
        assert rule.documentation.endswith("."), tag
        for name, attribute in rule.attributes.items():
            assert attribute.documentation.endswith("."), (tag, name)


@given(st.text("ab1_-. A\u00e4", max_size=6) | st.from_regex(r"\A[a-z][a-z0-9_-]{55,70}\Z"))
def test_a_name_is_legal_in_the_schema_exactly_if_it_is_in_the_code(name: str) -> None:
    assert is_host_name_of_the_schema(name) == is_legal(name)


KINDS = {
    extra["kind"]: TypeAdapter(kind)
    for kind in vars(values).values()
    for field in getattr(kind, "__metadata__", ())
    if isinstance(extra := getattr(field, "json_schema_extra", None), dict)
}
PROBES = "".join(f'<xs:element name="probe-{kind.replace(":", "-")}" type="{kind}"/>' for kind in KINDS)
PROBING = etree.XMLSchema(etree.fromstring(xsd_text().replace("</xs:schema>", f"{PROBES}</xs:schema>").encode()))
SAMPLES = [
    *("", " ", "0", "1", "+1", "-1", "-0", "1.", ".5", "1e3", " 1 ", "1 1", "1_0", "٣", "nan", "INF", "0x1", "--1"),
    *("86400", "86400.0", "86400.1", "-360", "65535", "65536", "2147483647", "2147483648", "-2147483649", "1001"),
    *("true", "True", " false", "yes", "a", "a b", "a  b ", "a b", "A", "a:b", "m.n:C", "m:C:D", "127.0.0.1"),
    *("::1", "one", "many", "backbone", "box", "person", "a-b", "a_b", "-a", "a" * 64, "x" * 4096, "x" * 4097),
]


@pytest.mark.parametrize("kind", KINDS)
def test_a_value_is_legal_in_the_schema_exactly_if_the_declaration_reads_it(kind: str) -> None:
    probe = etree.Element(f"probe-{kind.replace(':', '-')}")
    for text in SAMPLES:
        probe.text = text
        assert bool(PROBING.validate(probe)) == reads(KINDS[kind], text), text


def reads(kind: TypeAdapter[object], text: str) -> bool:
    try:
        kind.validate_python(text)
    except ValidationError:
        return False
    return True


def test_every_kind_of_value_that_is_declared_is_used() -> None:
    used = {one.kind for rule in vocabulary().values() for one in rule.attributes.values()}
    assert used == set(KINDS)


@pytest.mark.parametrize("file", [HERE / "small.xml", HERE.parents[2] / "mission.xml"], ids=["small", "mission"])
def test_other_tools_that_use_the_schema_accept_good_files(file: Path) -> None:
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False)
    assert SCHEMA.validate(etree.parse(file, parser)), SCHEMA.error_log
