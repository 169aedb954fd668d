"""The declared elements as rules: allowed and required attributes and children, defaults, meanings.

The rules are read from the JSON schema that pydantic makes of the declared classes. So XML schema, reference page,
editing and the designer's forms are independent of pydantic.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from backbone.mission.declaration.elements import MissionElement

ROOT = "mission"
MANY = 1 << 30  # any number of an element

Schema = dict[str, Any]
"""A JSON schema, or a part of one."""


@dataclass(frozen=True, slots=True)
class AttributeRule:
    """Declaration of an attribute.

    Attributes:
        kind: Its kind of value, see ``values``.
        required: Whether it must be given.
        default: Its value if it is left out; None: it has no default.
        documentation: Its meaning, with unit and range.
        schema: The JSON schema of its values.
    """

    kind: str
    required: bool
    default: str | None
    documentation: str
    schema: Schema

    @property
    def words(self) -> tuple[str, ...]:
        """The words that it accepts; empty if it accepts other values."""
        return ("true", "false") if self.schema.get("type") == "boolean" else tuple(self.schema.get("enum", ()))

    @property
    def remedy(self) -> str:
        """The rule for its value."""
        return str(self.schema.get("meaning", self.documentation))


@dataclass(frozen=True, slots=True)
class ElementRule:
    """Declaration of an element.

    Attributes:
        attributes: By name, in the usual order of writing.
        children: Tag → fewest and most of these children; in the usual order of writing.
    """

    attributes: dict[str, AttributeRule]
    children: dict[str, tuple[int, int]]
    documentation: str


@lru_cache(maxsize=1)
def vocabulary() -> Mapping[str, ElementRule]:
    """Return every element of a mission file by its tag, outer ones first."""
    schema = MissionElement.model_json_schema(by_alias=True)
    definitions = schema.pop("$defs")
    found: dict[str, ElementRule] = {}
    _collect(ROOT, schema, definitions, found)
    return found


def _collect(tag: str, schema: Schema, definitions: Schema, found: dict[str, ElementRule]) -> None:
    required = set(schema.get("required", ()))
    attributes: dict[str, AttributeRule] = {}
    children: dict[str, tuple[int, int]] = {}
    inside: dict[str, Schema] = {}
    for name, written in schema["properties"].items():
        one = _resolved(written, definitions)
        items = _resolved(one.get("items", {}), definitions)
        if "properties" in one:
            children[name], inside[name] = (int(name in required), 1), one
        elif "properties" in items:
            children[name], inside[name] = (int(one.get("minItems", 0)), MANY), items
        else:
            attributes[name] = _attribute(one, is_required=name in required)
    documentation = " ".join(schema.get("description", "").split())  # none with python -OO, which drops docstrings
    found[tag] = ElementRule(attributes, children, documentation)
    for child, its_schema in inside.items():
        if child not in found:
            _collect(child, its_schema, definitions, found)


def _resolved(schema: Schema, definitions: Schema) -> Schema:
    """Return a schema without references and without the alternative for an absent value."""
    if "anyOf" in schema:
        [one] = [each for each in schema["anyOf"] if each.get("type") != "null"]
        return {**_resolved(one, definitions), **{key: schema[key] for key in schema if key != "anyOf"}}
    if "$ref" in schema:
        own = {key: schema[key] for key in schema if key != "$ref"}
        return {**definitions[schema["$ref"].rpartition("/")[2]], **own}
    return schema


def _attribute(schema: Schema, *, is_required: bool) -> AttributeRule:
    default = None if is_required else schema.get("default")
    return AttributeRule(schema["kind"], is_required, _text(default), " ".join(schema["description"].split()), schema)


def _text(default: object) -> str | None:
    """Return a default as written in a mission file; None if there is none to write."""
    match default:
        case None | "" | [] | ():
            return None
        case bool():
            return str(default).lower()
        case float():
            return f"{default:g}"
        case _:
            return str(default)
