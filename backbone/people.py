"""People by their names: whoever reads of a console, or of what it claims, reads of the person who sits at it.

Rules of this file: pure. Who sits where is what consoles say of themselves; nothing proves it.

* One person is one name, at however many consoles.
* What a console claims bears the console's name before its own (``console-7-capture``), and reads as the person too.
* A name of which nobody is known stays as it is.
* Who has left is remembered for a while: timelines and logs speak of the past.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import TypeVar

import msgspec

from backbone.component.messages import ComponentState, StoryEvent
from backbone.naming import Subsystem, component_of
from backbone.printable import with_texts

CONSOLES_KEPT = 1_000  # chosen: those of a busy day
_NAME = re.compile(r"(?<![\w/#-])(?:(?:ui_console|resource_pool)/)?([a-z][a-z0-9_-]*)(?![\w/#-])")

Value = TypeVar("Value")


class People:
    """Who sits at which console.

    Args:
        components: Of the mission; consoles among them say who sits there.
    """

    def __init__(self, components: Iterable[ComponentState] = ()) -> None:
        self._called: dict[str, str] = {}
        for component in components:
            self.heard(component)

    def heard(self, component: ComponentState) -> None:
        """Take in who sits at this component, if it is a console that says so."""
        name = component_of(component.address)
        if component.user and is_console(component.address):
            self._called.pop(name, None)
            self._called[name] = component.user
        while len(self._called) > CONSOLES_KEPT:
            del self._called[next(iter(self._called))]

    def remember(self, consoles: Mapping[str, str]) -> None:
        """Take in who sat where; what is known already is newer.

        Args:
            consoles: Name of the console → the person's.
        """
        self._called = {**consoles, **self._called}

    @property
    def consoles(self) -> dict[str, str]:
        """Name of each console → the person's."""
        return dict(self._called)

    def person(self, name: str) -> str:
        """Return whom a console, or what it claims, is there for; the name itself if nobody is known.

        Args:
            name: Name or address.

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
        """Return the text with every name of a console, or of what it claims, replaced by the person's.

        Example:
            >>> people = People([ComponentState("ui_console/c-7", "console", "base", 7, "ready", 0.0, user="Anna B.")])
            >>> people.named("it was the turn of c-7-capture, not of c-70")
            'it was the turn of Anna B., not of c-70'
        """
        return _NAME.sub(self._name_of, text) if self._called else text

    def doing(self, component: ComponentState) -> str:
        """Return what a component says it is doing, beginning with who sits there if somebody does."""
        return f"{component.user} {self.named(component.feedback)}".strip()

    def named_event(self, event: StoryEvent) -> StoryEvent:
        """Return the event with the persons' names in what it says; where it was told and its cause stay."""
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
    """Say whether a person may sit at this address.

    Example:
        >>> is_console("ui_console/console-1"), is_console("resource_pool/scout1")
        (True, False)
    """
    return address.startswith(f"{Subsystem.UI_CONSOLE}/")


def screens_of(user: str, components: Iterable[ComponentState]) -> list[ComponentState]:
    """Return the consoles at which this person sits; more than one: it is one person with several screens."""
    return [each for each in components if user and each.user == user and is_console(each.address)]
