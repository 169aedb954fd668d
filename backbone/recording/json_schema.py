"""JSON Schemas of messages as a recording holds them: objects with the names of their fields.

On the wire a message is an array. In a recording it is an object, so that a file can be read without this code. The
docstring of a message class, with the meanings and units of its fields, is the description of its schema.
"""

from __future__ import annotations

import functools
import inspect as source
from typing import Any

import msgspec
from msgspec import inspect

from backbone.wire import Message, schema_of

DIALECT = "https://json-schema.org/draft/2020-12/schema"
TAG = "schema"
"""Name of the schema of a message inside another message."""
_PLAIN: dict[type[inspect.Type], dict[str, Any]] = {
    inspect.AnyType: {},
    inspect.NoneType: {"type": "null"},
    inspect.BoolType: {"type": "boolean"},
}
_BYTES = (inspect.BytesType, inspect.ByteArrayType, inspect.MemoryViewType)
_LISTS = (inspect.ListType, inspect.VarTupleType, inspect.SetType, inspect.FrozenSetType)


@functools.cache
def schema_json(kind: type[Message]) -> bytes:
    """Return the JSON Schema of a recorded message of this class: its ``body`` beside the fields of its envelope."""
    definitions: dict[str, dict[str, Any]] = {}
    envelope = {
        "sequence": {"type": "integer", "description": "Grows by one with each message of the sender."},
        "stamp_s": {"type": "number", "description": "Mission time of sending, seconds."},
        "heard_s": {"type": "number", "description": "Mission time when the recorder got it, seconds."},
        "cause": {"type": "string", "description": "Id of the message that led to it: <source>#<sequence>."},
        "body": _struct(kind, definitions),
    }
    schema = {
        "$schema": DIALECT,
        "title": schema_of(kind),
        "type": "object",
        "properties": envelope,
        "required": list(envelope),
        "$defs": definitions,
    }
    return msgspec.json.encode(schema)


@functools.cache
def fields_of(kind: type[msgspec.Struct]) -> tuple[inspect.Field, ...]:
    """Return the fields of a struct, with their types."""
    described = inspect.type_info(kind)
    assert isinstance(described, inspect.StructType)  # noqa: S101  of a struct
    return described.fields


def _struct(kind: type[msgspec.Struct], definitions: dict[str, dict[str, Any]]) -> dict[str, Any]:
    name = kind.__name__
    if name not in definitions:
        definitions[name] = {}  # a placeholder while its fields are described, because a struct may contain itself
        fields = fields_of(kind)
        definitions[name] = {
            "type": "object",
            "description": source.cleandoc(kind.__doc__ or ""),
            "properties": {field.name: _of(field.type, definitions) for field in fields},
        }
    return {"$ref": f"#/$defs/{name}"}


def _of(kind: inspect.Type, definitions: dict[str, dict[str, Any]]) -> dict[str, Any]:
    match kind:
        case inspect.Metadata(type=inner):
            return _of(inner, definitions)
        case inspect.IntType() | inspect.FloatType():
            return {"type": "integer" if isinstance(kind, inspect.IntType) else "number", **_limits(kind)}
        case inspect.StrType():
            return {"type": "string"}
        case inspect.EnumType(cls=choices):
            return {"enum": [choice.value for choice in choices]}
        case inspect.LiteralType(values=values):
            return {"enum": list(values)}
        case inspect.UnionType(types=types):
            return {"anyOf": [_of(each, definitions) for each in types]}
        case inspect.DictType(value_type=inner):
            return {"type": "object", "additionalProperties": _of(inner, definitions)}
        case inspect.StructType(cls=struct):
            return _struct(struct, definitions)
        case inspect.TupleType(item_types=items):
            return {"type": "array", "prefixItems": [_of(each, definitions) for each in items]}
    if isinstance(kind, _BYTES):
        return {"type": "string", "contentEncoding": "base64"}
    if isinstance(kind, _LISTS):
        return {"type": "array", "items": _of(kind.item_type, definitions)}
    return _PLAIN[type(kind)]


def _limits(kind: inspect.IntType | inspect.FloatType) -> dict[str, float]:
    names = {"minimum": kind.ge, "maximum": kind.le, "exclusiveMinimum": kind.gt, "exclusiveMaximum": kind.lt}
    return {name: limit for name, limit in names.items() if limit is not None}
