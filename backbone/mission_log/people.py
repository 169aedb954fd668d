"""People by their names: texts name the person at a console instead of the console or its ARC.

Rules of this file: pure. Consoles publish the names of their users, without proof.

* One person has one name, also at several consoles.
* The ARC of a console begins with the console's name (``console-7-capture``), and is replaced by the person too.
* A name without a known person stays unchanged.
* People who have left are kept for a while, because timelines and logs are about the past.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import TypeVar

import msgspec

from backbone.component.messages import ComponentState, StoryEvent
from backbone.naming import Subsystem, component_of
from backbone.printable import with_texts

CONSOLES_KEPT = 1_000  # chosen: the consoles of a busy day
_NAME = re.compile(r"(?<![\w/#-])(?:(?:ui_console|resource_pool)/)?([a-z][a-z0-9_-]*)(?![\w/#-])")

Value = TypeVar("Value")


class People:
    """The people at consoles.

    Args:
        components: Components of the mission; the states of consoles name their users.
    """

    def __init__(self, components: Iterable[ComponentState] = ()) -> None:
        self._called: dict[str, str] = {}
        for component in components:
            self.heard(component)

    def heard(self, component: ComponentState) -> None:
        """Record the person at this component, if it is a console with a user."""
        name = component_of(component.address)
        if component.user and is_console(component.address):
            self._called.pop(name, None)
            self._called[name] = component.user
        while len(self._called) > CONSOLES_KEPT:
            del self._called[next(iter(self._called))]

    def remember(self, consoles: Mapping[str, str]) -> None:
        """Add people of the past; known consoles keep their newer names.

        Args:
            consoles: Name of the console → name of the person.
        """
        self._called = {**consoles, **self._called}

    @property
    def consoles(self) -> dict[str, str]:
        """Name of each console → name of the person."""
        return dict(self._called)

    def person(self, name: str) -> str:
        """Return the person at a console, or behind its ARC; the name itself if no person is known.

        Args:
            name: Name or address of a console or an ARC.

        Example:
            >>> people = People([ComponentState("ui_console/c-7", "console", "base", 7, "ready", 0.0, user="Anna B.")])
            >>> people.person("ui_console/c-7"), people.person("c-7-capture"), people.person("watch1")
            ('Anna B.', 'Anna B.', 'watch1')
        """
        own = name = component_of(name)
        while name not in self._called:
            name, hyphen, _ = name.rpartition("-")
            if not hyphen:
                return own
        return self._called[name]

    def named(self, text: str) -> str:
        """Return the text with every name of a console or of its ARC replaced by the person's.

        Example:
            >>> people = People([ComponentState("ui_console/c-7", "console", "base", 7, "ready", 0.0, user="Anna B.")])
            >>> people.named("it was the turn of c-7-capture, not of c-70")
            'it was the turn of Anna B., not of c-70'
        """
        return _NAME.sub(self._name_of, text) if self._called else text

    def doing(self, component: ComponentState) -> str:
        """Return the component's feedback, after the name of the person at it, if any."""
        return f"{component.user} {self.named(component.feedback)}".strip()

    def named_event(self, event: StoryEvent) -> StoryEvent:
        """Return the event with people's names in its text; its place and its cause stay."""
        subject, what = self.person(event.subject), self.named(event.what)
        if (subject, what) == (event.subject, event.what):
            return event
        return msgspec.structs.replace(event, subject=subject, what=what)

    def named_all(self, value: Value) -> Value:
        """Return the message, list or dictionary with ``named`` applied to every text in it."""
        return with_texts(value, self.named) if self._called else value

    def _name_of(self, found: re.Match[str]) -> str:
        person = self.person(found[1])
        return found[0] if person == found[1] else person


def is_console(address: str) -> bool:
    """Return whether this is the address of a console.

    Example:
        >>> is_console("ui_console/console-1"), is_console("resource_pool/scout1")
        (True, False)
    """
    return address.startswith(f"{Subsystem.UI_CONSOLE}/")


def screens_of(user: str, components: Iterable[ComponentState]) -> list[ComponentState]:
    """Return the consoles of this person, who may use several screens."""
    return [each for each in components if user and each.user == user and is_console(each.address)]
