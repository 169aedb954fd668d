"""Parameters of a component from plain values."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from backbone.component.messages import WrongParameter


def parameters_from(values: Mapping[str, object], kind: type[msgspec.Struct]) -> msgspec.Struct:
    """Return the values as this class, or raise ``WrongParameter``."""
    try:
        return msgspec.convert(values, kind)
    except msgspec.ValidationError as error:
        raise WrongParameter(str(error)) from None
