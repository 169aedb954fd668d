"""What a person types into the fields of a command is a value in its range, or refused in a sentence."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.component.abilities import FieldForm, ValueKind
from ui_console.model.fields import WrongValue, default_text, label_of, read_fields

SPEED = FieldForm("pan_rad_s", ValueKind.NUMBER, "rad/s", -2.0, 2.0, is_required=True)
STEPS = FieldForm("steps", ValueKind.WHOLE, "", 1, 9, default=3)
LIT = FieldForm("lit", ValueKind.FLAG, default=True)
GAIT = FieldForm("gait", ValueKind.TEXT, default="walk", choices=["walk", "trot"])
SAID = FieldForm("said", ValueKind.TEXT, default="")


@pytest.mark.parametrize(
    ("field", "text", "value"),
    [
        (SPEED, " -1.5 ", -1.5),
        (STEPS, "4", 4),
        (LIT, "No", False),
        (LIT, "on", True),
        (GAIT, "trot", "trot"),
        (SAID, "hello there", "hello there"),
    ],
)
def test_a_text_is_read_as_its_field_says(field: FieldForm, text: str, value: object) -> None:
    assert read_fields([field], [text]) == {field.name: value}


@pytest.mark.parametrize(
    ("field", "text", "told"),
    [
        (SPEED, "", "pan needs a value"),
        (SPEED, "fast", "fast is no number"),
        (SPEED, "nan", "beyond"),
        (SPEED, "2.1", "pan, -2 to 2 rad/s: 2.1 is beyond that"),
        (STEPS, "1.5", "no whole number"),
        (LIT, "perhaps", "none of yes"),
        (GAIT, "fly", "fly is none of walk, trot"),
    ],
)
def test_a_text_that_is_no_value_of_its_field_is_refused_in_a_sentence(field: FieldForm, text: str, told: str) -> None:
    with pytest.raises(WrongValue, match=told):
        read_fields([field], [text])


def test_a_field_without_a_text_is_left_out_so_that_its_default_holds() -> None:
    assert read_fields([STEPS, LIT, SAID], ["", " ", ""]) == {}


@pytest.mark.parametrize("field", [STEPS, LIT, GAIT, SAID])
def test_the_text_that_is_filled_in_is_the_default(field: FieldForm) -> None:
    assert read_fields([field], [default_text(field)]).get(field.name, field.default) == field.default
    assert label_of(field).startswith(field.name)


@given(st.text(max_size=12))
def test_whatever_is_typed_is_in_range_or_refused(text: str) -> None:
    try:
        value = read_fields([SPEED], [text])["pan_rad_s"]
    except WrongValue:
        return
    assert -2.0 <= float(value) <= 2.0
