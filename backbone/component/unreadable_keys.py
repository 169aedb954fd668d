"""Keys whose publications a component cannot decode: it logs each key once, because its own work only stands still."""

from __future__ import annotations

from backbone.component.component_of_parts import ComponentOfParts
from backbone.component.log_level import LogLevel
from backbone.errors import Refusal

MOST_LOGGED = 16  # chosen: more than a correct mission has; garbage on thousands of keys does not fill the log


class UnreadableKeys:
    """Publishes one warning for each key, at the first publication that the component cannot decode.

    Args:
        component: The component, whose story gets the warnings.
    """

    def __init__(self, component: ComponentOfParts) -> None:
        self._component = component
        self._logged: set[str] = set()

    def log(self, key: str, refusal: Refusal) -> None:
        """Publish the warning, unless the key has had one or ``MOST_LOGGED`` keys have."""
        if key not in self._logged and len(self._logged) < MOST_LOGGED:
            self._logged.add(key)
            warning = f"cannot read {key}: {refusal.detail} (remedy: {refusal.remedy})"
            self._component.publish_event(self._component.name, warning, LogLevel.WARNING)
