"""The dependencies of each component, by which alarms find their common cause. Pure."""

from __future__ import annotations

from backbone.component.messages import ComponentState
from backbone.creator.messages import creator_name
from backbone.mission_log.people import is_console
from backbone.naming import component_of
from backbone.scheduling.views import Schedule


class Needs:
    """The components that each component needs, as far as messages name them."""

    def __init__(self) -> None:
        self._of: dict[str, frozenset[str]] = {}

    def heard(self, component: ComponentState) -> None:
        """Record the machine of a component, and the console for which it runs."""
        name = component_of(component.address)
        needs = {component_of(component.requester)} if is_console(component.requester) else set[str]()
        if not is_console(component.address):  # a console has no parent
            needs.add(creator_name(component.host))
        self._of[name] = frozenset(needs - {name})

    def forget(self, name: str) -> None:
        """Remove a component that left for good."""
        self._of.pop(name, None)

    def of(self, name: str, schedule: Schedule | None) -> frozenset[str]:
        """Return the names of its host's creator, its console, and the RCs that it requests."""
        requests = schedule.requests if schedule is not None else []
        return self._of.get(name, frozenset()).union(*(request.rcs for request in requests if request.arc == name))
