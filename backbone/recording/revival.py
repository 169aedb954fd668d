"""Restores the message that was sent from a recorded body. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import msgspec
from msgspec import inspect

from backbone.errors import Refusal
from backbone.naming import did_you_mean
from backbone.recording.json_schema import TAG, fields_of
from backbone.recording.reader import Recorded
from backbone.wire import WIRE_VERSION, Envelope, Message, naming_field, plain, schema_of

WRITE_ONE = 'Write an object like {"schema": "Halt", "epoch": 3}; "watch KEY --json" shows messages with their fields.'
Kind = TypeVar("Kind", bound=Message)


class OtherForm(Refusal):
    """A recorded message does not have the form that its class has in this release."""

    code = "recording.form"
    remedy = "Look into the recording with the release that made it, see 'scout-backbone recording info'."


def revived(kind: type[Kind], body: dict[str, Any] | list[Any]) -> Kind:
    """Return the message of this class that a recorded body holds; fields that are newer get their defaults.

    Args:
        body: Fields by name, or a list if the recorder did not know the class.

    Raises:
        OtherForm: The body does not fit the class.
    """
    try:
        listed = body if isinstance(body, list) else _listed_struct(kind, body)
        return msgspec.json.decode(msgspec.json.encode(listed), type=kind)
    except (msgspec.DecodeError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise OtherForm(f"{schema_of(kind)}: {naming_field(str(error), kind)}") from error


@dataclass(slots=True)
class Reviver:
    """Restores messages one after the other; those of another form are counted instead.

    Attributes:
        unread: Number of messages that have the name of an asked class, and another form or version than it.
    """

    unread: int = 0

    def revived(self, message: Recorded, *kinds: type[Kind]) -> Kind | None:
        """Return the message, if it is of one of these classes and has its form in this release."""
        name = message.schema.partition("/")[0]
        kind = next((one for one in kinds if schema_of(one).partition("/")[0] == name), None)
        if kind is None:
            return None
        try:
            if message.schema == schema_of(kind):
                return revived(kind, message.body)
        except OtherForm:
            pass
        self.unread += 1
        return None


def message_as_sent(classes: Mapping[str, type[Message]], message: Recorded) -> Message | None:
    """Return the message as it was sent; None: its class is not known, or has another form in this release."""
    kind = classes.get(message.schema)
    if kind is None or isinstance(message.body, bytes):
        return None
    try:
        return revived(kind, message.body)
    except OtherForm:
        return None


def envelope_as_sent(message: Recorded, said: Message) -> Envelope[Message]:
    """Return a recorded message, restored as ``said``, in the envelope of its sender."""
    return Envelope(WIRE_VERSION, message.source, message.sequence, message.stamp_s, message.cause, said)


def with_names(classes: Mapping[str, type[Message]], message: Recorded) -> Recorded:
    """Return the message with the names of its fields, if its class is known here and the recorder did not know it."""
    said = message_as_sent(classes, message) if isinstance(message.body, list) else None
    return message if said is None else replace(message, body=plain(said))


def message_from(classes: Mapping[str, type[Message]], said: object) -> Message:
    """Return the message that a person wrote: an object with ``schema`` and the fields of that message by name.

    Args:
        classes: Known message classes, by schema.
        said: The object; the version in ``schema`` is optional.

    Raises:
        OtherForm: No such schema or field exists, a field is missing, or a value is outside its range.
    """
    if not isinstance(said, dict) or not isinstance(said.get(TAG), str):
        raise OtherForm(f"it is no object with a {TAG!r}", remedy=WRITE_ONE)
    by_name = {schema.partition("/")[0]: kind for schema, kind in classes.items()}
    name = said[TAG]
    kind = classes.get(name) or by_name.get(name)
    if kind is None:
        raise OtherForm(f"no message is named {name!r}{did_you_mean(name, by_name)}", remedy=WRITE_ONE)
    fields = {field.name for field in fields_of(kind)}
    for unknown in sorted(said.keys() - fields - {TAG}):
        known = ", ".join(sorted(fields)) or "no fields"
        told = f"{schema_of(kind)} has no field {unknown!r}{did_you_mean(unknown, fields)}; it has {known}"
        raise OtherForm(told, remedy=WRITE_ONE)
    try:
        return revived(kind, said)
    except OtherForm as error:
        raise OtherForm(error.detail, remedy=WRITE_ONE) from error


def _listed(kind: inspect.Type, value: Any) -> Any:
    """Return the value in the form of the wire, in which structs declared ``array_like`` are lists."""
    match kind:
        case inspect.StructType(cls=struct):
            return _listed_struct(struct, value)
        case inspect.Metadata(type=inner):
            return _listed(inner, value)
        case inspect.ListType(item_type=inner) | inspect.VarTupleType(item_type=inner):
            return [_listed(inner, each) for each in value]
        case inspect.TupleType(item_types=inners):
            return [_listed(inner, each) for inner, each in zip(inners, value, strict=True)]
        case inspect.DictType(value_type=inner):
            return {name: _listed(inner, each) for name, each in value.items()}
        case inspect.UnionType(types=types):
            fits = next((one for one in types if _may_hold(one, value)), None)
            return value if fits is None else _listed(fits, value)
    return value


def _may_hold(kind: inspect.Type, value: Any) -> bool:
    """Return whether this member of a union may hold the value, which is not a plain one."""
    match kind:
        case inspect.StructType(cls=struct):
            if isinstance(value, dict) and TAG in value and issubclass(struct, Message):
                return bool(value[TAG] == schema_of(struct))
            return isinstance(value, dict)
        case inspect.DictType():
            return isinstance(value, dict)
        case inspect.ListType() | inspect.VarTupleType() | inspect.TupleType():
            return isinstance(value, list)
        case inspect.Metadata(type=inner):
            return _may_hold(inner, value)
    return False


def _listed_struct(struct: type[msgspec.Struct], value: dict[str, Any]) -> Any:
    fields, config = fields_of(struct), struct.__struct_config__
    named = {field.encode_name: _field(field, value) for field in fields}
    if not config.array_like:
        return named if config.tag is None else {config.tag_field: config.tag, **named}
    return [*([] if config.tag is None else [config.tag]), *named.values()]


def _field(field: inspect.Field, value: dict[str, Any]) -> Any:
    if field.name in value:
        return _listed(field.type, value[field.name])
    if field.default_factory is not msgspec.NODEFAULT:
        return msgspec.to_builtins(field.default_factory())
    if field.default is msgspec.NODEFAULT:
        raise LookupError(f"no {field.name}")
    return msgspec.to_builtins(field.default)
