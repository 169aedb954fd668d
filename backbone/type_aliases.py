"""Aliases of types that Python 3.12's ``type`` statement makes: objects that only name another type."""

from __future__ import annotations

import typing

_ALIAS: typing.Any = getattr(typing, "TypeAliasType", ())  # Python 3.11 has none


def unaliased(kind: object) -> object:
    """Return the type that an alias names, and every other type unchanged; aliases inside it remain."""
    if isinstance(kind, _ALIAS):
        return unaliased(kind.__value__)
    if isinstance(generic := typing.get_origin(kind), _ALIAS):
        return unaliased(generic.__value__[typing.get_args(kind)])
    return kind
