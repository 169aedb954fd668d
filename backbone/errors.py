"""What can go wrong between components, and whose fault it is.

Three kinds, never mixed:

* ``Refusal``: the other side understood and said no.  Nothing changed there.  It travels over the
  bus as (code, detail, remedy, facts) and is raised again on the asking side as the same class.
* ``LinkError``: no answer came.  The outcome is *unknown*, which is never the same as failed.
* anything else is a bug: it is not caught, the process dies, its creator reports and restarts it.

A code is for machines, the detail carries the numbers for people, the remedy is for operators.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

Fact = str | int | float | bool


class BackboneError(Exception):
    """Root of everything this project raises on purpose."""


class Refusal(BackboneError):
    """A typed no: nothing was changed by what was asked.

    Attributes:
        code: Stable word for machines, ``subject.reason``.
        remedy: What the operator or developer can do about it.
        detail: The sentence with the names and numbers of this case.
        facts: The same names and numbers for programs.
    """

    code: ClassVar[str] = "refused"
    remedy: str = "Read the detail; nothing was changed."

    def __init__(self, detail: str, *, remedy: str | None = None, **facts: Fact) -> None:
        super().__init__(detail)
        self.detail = detail
        self.facts: Mapping[str, Fact] = facts
        if remedy is not None:
            self.remedy = remedy

    def __init_subclass__(cls, **kwargs: object) -> None:
        super().__init_subclass__(**kwargs)
        if "code" in cls.__dict__:  # a class that inherits its code travels as the class it inherits it from
            _classes_by_code[cls.code] = cls

    def __str__(self) -> str:
        return f"{self.detail} ({self.remedy})"


_classes_by_code: dict[str, type[Refusal]] = {}


class UnknownRefusal(Refusal):
    """A refusal of a class this process never imported; its own code is in ``facts["code"]``."""

    code = "refused.unknown"


def revive(code: str, detail: str, remedy: str, facts: Mapping[str, Fact]) -> Refusal:
    """Return the refusal that was sent, as the class it had there if this process knows it.

    What was sent is taken as it is: the class's own constructor is not called, so no content can
    make this fail.

    Example:
        >>> revive("refused", "no", "ask later", {}).remedy
        'ask later'
    """
    kind = Refusal if code == Refusal.code else _classes_by_code.get(code)
    if kind is None:
        kind, facts = UnknownRefusal, {**facts, "code": code}
    refusal = kind.__new__(kind, detail)
    refusal.detail, refusal.remedy, refusal.facts = detail, remedy, facts
    return refusal


def code_of(refusal: Refusal) -> str:
    """Return the code under which the refusal was first raised, also when its class is unknown here."""
    return str(refusal.facts.get("code", refusal.code)) if isinstance(refusal, UnknownRefusal) else refusal.code


class LinkError(BackboneError):
    """No answer: what was asked may or may not have happened."""


class NoResponder(LinkError):
    """Nobody answers at this address, or the one who did died before answering."""


class ReplyTimeout(LinkError):
    """Somebody is there but did not answer in time."""


class HubUnreachable(LinkError):
    """The mission's hub could not be reached."""


class OutcomeUnknown(Refusal):
    """The one asked had to ask another, who did not answer: what was wanted may or may not have happened."""

    code = "link.unknown"
    remedy = "Ask how things are before you ask again."
