"""The XML schema of mission files, for editors and other tools; made from the declared elements.

The schema accepts every valid mission file. It is more lenient than ``check`` in one place. If two counted children may
come in any order among repeated ones, XSD 1.0 can count only one of the two. The schema counts the required child, or
else the first.
"""

from __future__ import annotations

from collections.abc import Iterator
from xml.sax.saxutils import escape, quoteattr

from backbone.mission.declaration.values import LEAST_WHOLE, MOST_WHOLE
from backbone.mission.declaration.vocabulary import MANY, AttributeRule, ElementRule, Schema, vocabulary

XSD = "mission.xsd"

_HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<!--
  Schema of mission files, made by: python -m tests.made_files
  Which elements and attributes there are and what values they take. Children may stand in any order.
-->
<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema" elementFormDefault="qualified">
"""
_BUILT_IN = "xs:"  # the prefix of kinds that XML Schema has itself
_FACETS = {
    "minimum": "minInclusive",
    "exclusiveMinimum": "minExclusive",
    "maximum": "maxInclusive",
    "exclusiveMaximum": "maxExclusive",
    "minLength": "minLength",
    "maxLength": "maxLength",
}


def xsd_text() -> str:
    """Return the schema."""
    return "\n".join([_HEAD, *_elements(), *_simple_types(), "</xs:schema>", ""])


def _elements() -> Iterator[str]:
    for tag, rule in vocabulary().items():
        yield f'  <xs:element name="{tag}">'
        yield f"    {_documentation(rule.documentation)}"
        yield "    <xs:complexType>"
        yield from (f"      {line}" for line in _content(rule))
        for name, attribute in rule.attributes.items():
            yield f"      {_attribute_begin(name, attribute)}"
            yield f"        {_documentation(attribute.documentation)}"
            yield "      </xs:attribute>"
        yield "    </xs:complexType>"
        yield "  </xs:element>"
        yield ""


def _attribute_begin(name: str, rule: AttributeRule) -> str:
    use = ' use="required"' if rule.required else ""
    default = "" if rule.default is None else f" default={quoteattr(rule.default)}"
    return f'<xs:attribute name="{name}" type="{rule.kind}"{use}{default}>'


def _content(rule: ElementRule) -> list[str]:
    """Return the content model of the element: its children may come in any order."""
    single = [tag for tag, (_least, most) in rule.children.items() if most == 1]
    repeated = [tag for tag in rule.children if tag not in single]
    if not rule.children:
        return []
    if not repeated:
        return ["<xs:all>", *(f"  {_reference(tag, *rule.children[tag])}" for tag in single), "</xs:all>"]
    if not single and len(repeated) == 1:
        return ["<xs:sequence>", f"  {_reference(repeated[0], *rule.children[repeated[0]])}", "</xs:sequence>"]
    counted = [tag for tag in single if rule.children[tag][0]] or single
    others = _choice([tag for tag in rule.children if tag not in counted[:1]])
    if not counted:
        return others
    least = rule.children[counted[0]][0]
    return [
        "<xs:sequence>",
        *(f"  {line}" for line in others),
        f'  <xs:sequence minOccurs="{least}">',
        f"    {_reference(counted[0], 1, 1)}",
        *(f"    {line}" for line in others),
        "  </xs:sequence>",
        "</xs:sequence>",
    ]


def _choice(tags: list[str]) -> list[str]:
    references = (f'  <xs:element ref="{tag}"/>' for tag in tags)
    return ['<xs:choice minOccurs="0" maxOccurs="unbounded">', *references, "</xs:choice>"]


def _reference(tag: str, least: int, most: int) -> str:
    lower = "" if least == 1 else f' minOccurs="{least}"'
    upper = "" if most == 1 else ' maxOccurs="unbounded"' if most == MANY else f' maxOccurs="{most}"'
    return f'<xs:element ref="{tag}"{lower}{upper}/>'


def _simple_types() -> Iterator[str]:
    kinds = {one.kind: one for rule in vocabulary().values() for one in rule.attributes.values()}
    for kind, one in sorted(kinds.items()):
        if kind.startswith(_BUILT_IN):
            continue
        yield f'  <xs:simpleType name="{kind}">'
        if "meaning" in one.schema:
            yield f"    {_documentation(one.remedy)}"
        if one.schema.get("type") == "array":
            yield f'    <xs:list itemType="{one.schema["items"]["kind"]}"/>'
        else:
            yield f'    <xs:restriction base="{_base(one.schema)}">'
            yield from (f"      {facet}" for facet in _facets(one.schema))
            yield "    </xs:restriction>"
        yield "  </xs:simpleType>"


def _base(schema: Schema) -> str:
    return {"number": "xs:decimal", "integer": "xs:int"}.get(schema.get("type", ""), "xs:string")


def _facets(schema: Schema) -> Iterator[str]:
    for word in schema.get("enum", ()):
        yield f"<xs:enumeration value={quoteattr(word)}/>"
    if "pattern" in schema:
        yield f"<xs:pattern value={quoteattr(schema['pattern'].removeprefix('^').removesuffix('$'))}/>"
    for key, facet in _FACETS.items():
        if key in schema and schema[key] not in (LEAST_WHOLE, MOST_WHOLE):
            yield f'<xs:{facet} value="{schema[key]:.15g}"/>'


def _documentation(text: str) -> str:
    return f"<xs:annotation><xs:documentation>{escape(text)}</xs:documentation></xs:annotation>"
