"""Errors between components, and which side is at fault.

There are three kinds:

* ``Refusal``: the receiver refused and changed nothing. A refusal travels over the bus as (code, detail, remedy, facts)
  and is raised again at the requester as the same class.
* ``LinkError``: no answer arrived. The outcome is *unknown*, which never means failed.
* Any other exception is a bug: it is not caught, the process dies, its creator reports and restarts it.

A code is for machines, the detail carries the numbers for people, the remedy is for operators.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Iterable, Mapping
from traceback import walk_tb
from types import FrameType
from typing import ClassVar

from backbone.printable_text import MOST_CHARACTERS, printable
from backbone.shipped import PACKAGES

_LIBRARIES = frozenset({"cv2", "mcap", "msgspec", "mujoco", "numpy", "pydantic", "rich", "textual", "uvloop", "zenoh"})
_NOT_A_DEVELOPERS = _LIBRARIES.union(PACKAGES) | sys.stdlib_module_names

Fact = str | int | float | bool


class BackboneError(Exception):
    """Base class of all exceptions that this project raises on purpose."""


class Refusal(BackboneError):
    """A typed refusal; the request changed nothing.

    Attributes:
        code: Stable code for machines, ``subject.reason``.
        remedy: What the operator or developer can do.
        detail: A sentence with the names and numbers of this case.
        facts: The same names and numbers for programs.
    """

    code: ClassVar[str] = "refused"
    remedy: str = "Read the detail; nothing was changed."

    def __init__(self, detail: str, *, remedy: str | None = None, **facts: Fact) -> None:
        super().__init__(detail)
        self.detail = str(detail)  # a developer may pass the exception of a library
        self.facts: Mapping[str, Fact] = facts
        if remedy is not None:
            self.remedy = remedy

    def __init_subclass__(cls, **kwargs: object) -> None:
        super().__init_subclass__(**kwargs)
        if "code" in cls.__dict__:  # a class that inherits its code travels as its base class
            _classes_by_code[cls.code] = cls

    def __str__(self) -> str:
        first, end, others = self.detail.partition("\n")  # the others are the end of a log
        return f"{first} ({self.remedy}){end}{others}"


_classes_by_code: dict[str, type[Refusal]] = {}


class UnknownRefusal(Refusal):
    """A refusal of a class that this process has not imported; its code is in ``facts["code"]``."""

    code = "refused.unknown"


def revive(code: str, detail: str, remedy: str, facts: Mapping[str, Fact]) -> Refusal:
    """Return the refusal that was sent, as its own class if this process knows the class.

    The class's own constructor is not called, so no content can make this fail.

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
    """Return the code under which the refusal was raised, also if its class is unknown here."""
    return str(refusal.facts.get("code", refusal.code)) if isinstance(refusal, UnknownRefusal) else refusal.code


NO_MORE_TASKS = "no more processes and threads may begin: see ulimit -u and pids.max"
"""The limit of the account (setrlimit(2), RLIMIT_NPROC), or that of its container or service (cgroup) is reached."""

_NO_THREAD = ("can't start new thread", "can't spawn worker thread")  # of CPython, and of zenoh's runtime, tokio


def named(error: BaseException) -> str:
    """Return the class and the text of an exception; a class whose text fails is named all the same.

    Example:
        >>> named(ValueError("no picture")), named(SystemExit())
        ('ValueError: no picture', 'SystemExit: ')
    """
    try:
        told = str(error)
    except Exception as failed:
        told = f"its __str__ raised {type(failed).__name__}"
    return f"{type(error).__name__}: {told}"


def complaint(error: BaseException, most: int = MOST_CHARACTERS) -> str:
    """Return an exception as one printable line of bounded length, with its place in the code if it has one.

    Args:
        most: Characters of the exception's own text; the place is never cut off.

    Example:
        >>> complaint(ValueError("no picture"))
        'ValueError: no picture'
        >>> complaint(RuntimeError("can't start new thread"))
        "RuntimeError: can't start new thread; no more processes and threads may begin: see ulimit -u and pids.max"
    """
    told = printable(" ".join(named(error).split()), most)
    if any(text in told for text in _NO_THREAD):
        told = f"{told}; {NO_MORE_TASKS}"
    frames = list(walk_tb(error.__traceback__))
    inmost = f"{frames[-1][0].f_code.co_filename}, line {frames[-1][1]}" if frames else ""
    place = own_place(error) or printable(inmost)
    return f"{told} ({place})" if place else told


def own_place(error: BaseException) -> str:
    """Return the file and line of a developer through which an exception came; empty: it came through none.

    Such a line can be mended by him, unlike the line of a library or of this project that raised at his call.
    """
    if isinstance(error, SyntaxError) and error.filename is not None:
        return printable(f"{error.filename}, line {error.lineno}")
    return _own_place(walk_tb(error.__traceback__))


def waiting_place(coroutine: object) -> str:
    """Return the file and line of a developer at which a coroutine waits; empty: it waits in no such file.

    A coroutine that waits for another task has the place of its own ``await``.
    """
    frames: list[tuple[FrameType, int]] = []
    while inspect.iscoroutine(coroutine):
        if coroutine.cr_frame is not None:
            frames.append((coroutine.cr_frame, coroutine.cr_frame.f_lineno))
        coroutine = coroutine.cr_await
    return _own_place(frames)


def _own_place(frames: Iterable[tuple[FrameType, int]]) -> str:
    places = [(_package(frame), f"{frame.f_code.co_filename}, line {line}") for frame, line in frames]
    own = next((package for package, _ in places if package not in _NOT_A_DEVELOPERS), "")
    return printable(next((place for package, place in reversed(places) if package == own), ""))


def defined_at(function: Callable[..., object]) -> str:
    """Return the file and line at which a function of Python begins; empty: it is no such function."""
    code = getattr(inspect.unwrap(function), "__code__", None)
    return "" if code is None else printable(f"{code.co_filename}, line {code.co_firstlineno}")


def _package(frame: FrameType) -> str:
    """Return the outermost package of the code in this frame; a program that ``python -m`` runs has one, too."""
    spec = frame.f_globals.get("__spec__")
    return str(frame.f_globals.get("__name__") if spec is None else spec.name).partition(".")[0]


class LinkError(BackboneError):
    """No answer arrived; the outcome is unknown."""


class NoResponder(LinkError):
    """No component serves this address, or it died before its answer."""


class ReplyTimeout(LinkError):
    """The component did not answer in time."""


class HubUnreachable(LinkError):
    """The mission's hub cannot be reached."""


class OutcomeUnknown(Refusal):
    """The component got no answer to a question of its own; the outcome is unknown."""

    code = "link.unknown"
    remedy = "Look at the present state before you ask again."
