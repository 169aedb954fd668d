"""Fields of a command in the form for people. Pure."""

from __future__ import annotations

import math

from backbone.component.abilities import UNLIMITED, FieldForm, ValueKind, range_text
from backbone.errors import Refusal
from backbone.spoken import three_digits
from ui_console.model.applied import words_of

FLAGS = {"yes": True, "on": True, "true": True, "1": True, "no": False, "off": False, "false": False, "0": False}


class WrongValue(Refusal):
    """A typed value does not fit its field."""

    code = "console.wrong_value"
    remedy = "Type a value within the range that is shown beside the field."


def label_of(field: FieldForm) -> str:
    """Return the name of a field with its range and unit.

    Example:
        >>> label_of(FieldForm("turn_rad_s", ValueKind.NUMBER, "rad/s", -7.143, 7.143))
        'turn, -7.14 to 7.14 rad/s'
        >>> label_of(FieldForm("for_s", ValueKind.NUMBER, "s", least=0.0))
        'for, at least 0 s'
        >>> label_of(FieldForm("pitch_hz", ValueKind.NUMBER, "Hz", 100.0, 4000.0))
        'pitch, 100 to 4000 Hz'
        >>> label_of(FieldForm("on", ValueKind.FLAG)), label_of(FieldForm("gait", ValueKind.TEXT, choices=["trot"]))
        ('on, yes or no', 'gait: trot')
    """
    words, legal = words_of(field.name), range_text(field, three_digits)
    if field.choices:
        return f"{words}: {legal}"
    unit = f" {field.unit}" if field.unit and field.kind is not ValueKind.FLAG else ""
    return f"{words}, {legal}{unit}" if legal else f"{words},{unit}" if unit else words


def has_range(field: FieldForm) -> bool:
    """Return whether a field is a number with both limits."""
    is_number = field.kind in (ValueKind.NUMBER, ValueKind.WHOLE)
    return is_number and field.least > -UNLIMITED and field.most < UNLIMITED


def default_text(field: FieldForm) -> str:
    """Return the initial text of a field; empty if the field needs a value."""
    if field.is_required:
        return ""
    if isinstance(field.default, bool):
        return "yes" if field.default else "no"
    return field.default if isinstance(field.default, str) else f"{field.default:g}"


def read_fields(fields: list[FieldForm], texts: list[str]) -> dict[str, float | bool | str]:
    """Return the values of typed texts; a field without a text is left out, so its default applies.

    Raises:
        WrongValue: A text is not a legal value of its field, or a required text is missing.
    """
    values = {}
    for field, text in zip(fields, texts, strict=True):
        if text.strip() or field.is_required:
            values[field.name] = _read(field, text.strip())
    return values


def _read(field: FieldForm, text: str) -> float | bool | str:
    if not text:
        raise WrongValue(f"{words_of(field.name)} needs a value", field=field.name)
    match field.kind:
        case ValueKind.FLAG:
            return _one_of(field, text.lower(), FLAGS)
        case ValueKind.NUMBER | ValueKind.WHOLE:
            return _number(field, text)
        case _:
            return _one_of(field, text, {choice: choice for choice in field.choices}) if field.choices else text


def _one_of(field: FieldForm, text: str, values: dict[str, bool] | dict[str, str]) -> bool | str:
    if text not in values:
        raise WrongValue(f"{words_of(field.name)}: {text} is none of {', '.join(values)}", field=field.name)
    return values[text]


def _number(field: FieldForm, text: str) -> float:
    try:
        value = float(text) if field.kind is ValueKind.NUMBER else int(text)
    except ValueError:
        kind = "number" if field.kind is ValueKind.NUMBER else "whole number"
        raise WrongValue(f"{words_of(field.name)}: {text} is no {kind}", field=field.name) from None
    if not (math.isfinite(value) and field.least <= value <= field.most):
        raise WrongValue(f"{label_of(field)}: {text} is beyond that", field=field.name)
    return value
