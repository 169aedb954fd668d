"""Parameters of a component from plain values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

import msgspec

from backbone.component.messages import WrongParameter

Parameters = TypeVar("Parameters", bound=msgspec.Struct)


def parameters_from(values: Mapping[str, object], kind: type[Parameters], of: str = "") -> Parameters:
    """Return the values as this class.

    Args:
        of: Name of the component or resource, for the refusal; empty: the caller names it.

    Raises:
        WrongParameter: A value does not fit the class, or the class has no such parameter.
    """
    try:
        return msgspec.convert(values, kind)
    except msgspec.ValidationError as error:
        if not of:
            raise WrongParameter(str(error)) from None
        names = ", ".join(field.encode_name for field in msgspec.structs.fields(kind))
        remedy = f"Its parameters are {names or 'none'}; give each a value of its type."
        raise WrongParameter(f"{of}: {error}", remedy=remedy) from None
