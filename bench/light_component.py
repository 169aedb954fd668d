"""The lightest possible component, for the benches."""

from __future__ import annotations

from backbone.component.component import Component, NoParameters


class Light(Component[NoParameters]):
    """Is ready and waits."""
