"""Facts of a component class: its documentation, and the parameters that a mission file may set.

Pure: data, and the checks of values against it. ``class_asking`` gets the data from classes.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from importlib import resources
from typing import Annotated, Any, Literal, Union

import msgspec

from backbone.component.abilities import NO_ABILITIES, Abilities
from backbone.spoken import counted

SHIPPED = "shipped_classes.json"
ANY_ARC = "any"
PLANNER = "planner"  # the RC manager's parameter that names a planner of one's own

_LIMITS = {"minimum": "at least", "exclusiveMinimum": "above", "maximum": "at most", "exclusiveMaximum": "below"}
_LENGTHS = {"minLength": "at least", "maxLength": "at most"}
_META = {"minimum": "ge", "exclusiveMinimum": "gt", "maximum": "le", "exclusiveMaximum": "lt"}
_META |= {"pattern": "pattern", "minLength": "min_length", "maxLength": "max_length"}
_PEOPLE = {"number": "a number", "integer": "a whole number", "string": "a text", "boolean": "true or false"}
_PEOPLE |= {"array": "a list, which no mission file gives", "object": "a struct, which no mission file gives"}
_TYPES = {"number": float, "integer": int, "string": str, "boolean": bool, "null": None}


ValueSchema = dict[str, Any]
"""The JSON schema of the values of a parameter."""


class ParameterFacts(msgspec.Struct, frozen=True):
    """A parameter of a class.

    Attributes:
        schema: The JSON schema of its values, as msgspec derives it from the parameter's type.
    """

    name: str
    schema: ValueSchema = {}
    doc: str = ""

    @property
    def is_required(self) -> bool:
        """True if a mission file must set this parameter."""
        return "default" not in self.schema

    @property
    def default(self) -> str:
        """Its default, as JSON; empty: a mission file must set it."""
        return "" if self.is_required else msgspec.json.encode(self.schema["default"]).decode()

    @property
    def type(self) -> str:
        """The kind of its values: number, integer, string, boolean, or a list of words."""
        return _type_text(self.schema)

    @property
    def words(self) -> tuple[str, ...]:
        """The words that it accepts; empty if it accepts other values."""
        if self.schema.get("type") == "boolean":
            return ("true", "false")
        return tuple(map(str, self.schema.get("enum", ())))

    @property
    def legal_values(self) -> str:
        """Kind and range of its values for people, as in ``a number, above 0, at most 1``."""
        return ", ".join([_PEOPLE.get(self.type, self.type), *self._span])

    @property
    def meaning(self) -> str:
        """Its meaning, and its legal values."""
        return "; ".join(part for part in (self.doc.rstrip("."), self.legal_values) if part)

    @property
    def summary(self) -> str:
        """Type, range and default on one line."""
        return ", ".join([self.type, *self._span, f"default {self.default}" if self.default else "required"])

    @property
    def _span(self) -> list[str]:
        spans = [f"{word} {self.schema[limit]:g}" for limit, word in _LIMITS.items() if limit in self.schema]
        lengths = [(word, self.schema[limit]) for limit, word in _LENGTHS.items() if limit in self.schema]
        spans += [f"{word} {counted(length, 'character')}" for word, length in lengths]
        return [*spans, f"of the pattern {self.schema['pattern']}"] if "pattern" in self.schema else spans

    def accepts(self, value: object) -> bool:
        """Return whether the class can start with this value."""
        try:
            msgspec.convert(value, _value_type(self.schema))
        except msgspec.ValidationError:
            return False
        return True


class ClassFacts(msgspec.Struct, frozen=True):
    """Facts of a class.

    Attributes:
        parameters: Parameters that a mission file may set.
        options: Driver → further parameters while this driver is used; None: the class uses no driver.
        driver_field: Parameter that names the driver if it is set; else the attribute ``driver`` does.
        has_rules: Whether it has rules for its parameters besides their types; only the class itself can check these.
        children: Fewest and most children of a behavior; None: any number.
        may_claim: False: a behavior of this class has no ARC.
        needs_arc: Kind of ARC like which a behavior of this class needs one; ``ANY_ARC``: it needs one of any kind;
            empty: it needs none.
        failure: Why the facts are unknown; empty: they are known.
        abilities: The commands that its components obey, and the values that they report.
        given: Parameters that other elements and attributes of the mission file set.
        shares_process: Whether the placer may put its components into a process with others.
        alike_most: Largest number of its components in one process; 1: they do not share one.
        roles: Role → kind of RC in the set of an ARC; empty: it is no ARC.
        locates: Whether it answers ``AskPose``, as localizers do.
    """

    doc: str = ""
    parameters: tuple[ParameterFacts, ...] = ()
    options: dict[str, tuple[ParameterFacts, ...]] | None = None
    driver_field: str = "driver"
    has_rules: bool = False
    children: tuple[int, int] | None = None
    may_claim: bool = True
    needs_arc: str = ""
    failure: str = ""
    abilities: Abilities = NO_ABILITIES
    given: tuple[str, ...] = ()
    shares_process: bool = True
    alike_most: int = 1
    roles: dict[str, str] = {}
    locates: bool = False

    def parameters_with(self, driver: str) -> tuple[ParameterFacts, ...] | None:
        """Return all parameters that can be set while this driver is used; None if the driver is unknown."""
        if self.options is None:
            return self.parameters
        return None if driver not in self.options else (*self.parameters, *self.options[driver])


class Question(msgspec.Struct, frozen=True):
    """A question to a class: does it start with these parameters?

    Attributes:
        class_path: The class.
    """

    class_path: str
    values: dict[str, Any]


@lru_cache(maxsize=1)
def shipped_classes() -> Mapping[str, ClassFacts]:
    """Return the facts of every shipped class, by class path."""
    text = resources.files("backbone.mission").joinpath(SHIPPED).read_bytes()
    return msgspec.json.decode(text, type=dict[str, ClassFacts])


def parameters_of(struct: type[msgspec.Struct]) -> tuple[ParameterFacts, ...]:
    """Return the facts of every field of a parameters' type, in the order of declaration."""
    (schema,), definitions = msgspec.json.schema_components([struct], ref_template="{name}")
    declared = definitions[schema["$ref"]]
    return tuple(
        ParameterFacts(name, _simple(one, definitions), str(one.get("description", "")))
        for name, one in declared["properties"].items()
    )


def _simple(one: ValueSchema, definitions: ValueSchema) -> ValueSchema:
    """Return the part of a schema that fits values in a mission file: no objects, no lists."""
    if "$ref" in one:
        beside = {key: value for key, value in one.items() if key != "$ref"}  # such as the default
        return _simple({**definitions[one["$ref"]], **beside}, definitions)
    kept = {key: one[key] for key in ("type", "enum", "default", "names", "counts", "along", *_META) if key in one}
    if "anyOf" in one:
        kept["anyOf"] = [_simple(each, definitions) for each in one["anyOf"]]
    return kept


def _type_text(schema: ValueSchema) -> str:
    if "enum" in schema:
        return "one of " + ", ".join(map(str, schema["enum"]))
    if "anyOf" in schema:
        return " or ".join(_type_text(each) for each in schema["anyOf"])
    return str(schema.get("type", "any"))


def _value_type(schema: ValueSchema) -> Any:
    """Return a type for which msgspec accepts the same values as the schema."""
    if "enum" in schema:
        return Literal[tuple(schema["enum"])]
    if "anyOf" in schema:
        return Union[tuple(_value_type(each) for each in schema["anyOf"])]  # noqa: UP007  # made of a list
    if "type" not in schema:
        return Any
    if schema["type"] not in _TYPES:
        return list  # an object or a list, which no mission file can give
    limits = {_META[key]: schema[key] for key in _META if key in schema}
    plain: Any = _TYPES[schema["type"]]
    return Annotated[plain, msgspec.Meta(**limits)] if limits else plain
