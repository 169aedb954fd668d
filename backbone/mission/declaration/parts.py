"""Common base of all declared elements, and the element that several others contain."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from backbone.mission.declaration.values import ParameterName, Text

PROCESS: Any = Field(
    default="",
    description="Name of the process it shares with all others of that name; all are on the host that any of them "
    "names; left out: a process of its own.",
)


def attribute_name(field: str) -> str:
    """Return a field's name as written in mission files."""
    return field.replace("_", "-")


class Declared(BaseModel):
    """An element of a mission file.

    A field is an attribute, or, if its type is another element, a child. The order of the fields is the usual order of
    writing. The docstring is the element's meaning, a field's description the attribute's.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True, alias_generator=attribute_name)


class ParameterElement(Declared):
    """A value for a parameter of the class that runs the element around it."""

    name: ParameterName = Field(
        description="Name of the parameter: a lower-case letter, then lower-case letters, digits or '_'."
    )
    value: Text = Field(description="Its value: a number or true or false if it reads as one in JSON, otherwise text.")
