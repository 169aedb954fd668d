"""Module: an algorithm with declared inputs and outputs, without access to bus or clock.

Derive, declare ``Inputs`` and ``Outputs``, override ``update``. The attributes that a module keeps between two updates
are set in ``reset``, or declared as ``State``. Three lines test a module::

    averaging = Averaging(Averaging.Parameters(count=2))
    averaging.update(Averaging.Inputs(Number(1.0)))
    assert averaging.update(Averaging.Inputs(Number(2.0))) == Averaging.Outputs(Number(1.5))

Source: RoboFrame 2006, section III: modules in threads, connected by key and type.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

import msgspec

from backbone.component.class_faults import class_faults, untyped_fields
from mission_control.modules.ports import ModulePorts, Ports, WrongDeclaration, ports_of, type_name

if TYPE_CHECKING:  # most modules use no pictures and need no NumPy
    import numpy as np
    from numpy.typing import NDArray


class Debug(Protocol):
    """Interface by which a module shows named pictures and values; see ``mission_control.debug_views.DebugViews``."""

    def picture(self, view: str, make: Callable[[], NDArray[np.generic]]) -> None:
        """Show a picture; if a console watches the view, ``make`` is called at once, else never."""

    def value(self, view: str, value: float | bool | str) -> None:
        """Show a value."""


class Unseen:
    """The debug views of a module outside a mission: they do nothing."""

    def picture(self, view: str, make: Callable[[], NDArray[np.generic]]) -> None:
        """Do nothing."""

    def value(self, view: str, value: float | bool | str) -> None:
        """Do nothing."""


UNSEEN = Unseen()


class Module:
    """Base class of every module.

    A derived class declares the classes that it needs; the others are empty by default.

    Args:
        parameters: Its ``Parameters``; left out: the defaults.
    """

    class Inputs(Ports):
        """Argument of ``update``; see ``ports``."""

    class Outputs(Ports):
        """Result of ``update``; see ``ports``."""

    class Parameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
        """Values that a mission file can set; it must set values without a default."""

    class State(msgspec.Struct):
        """Values that the module keeps between two updates and hands over in an exchange; each field has a default."""

    state: Any
    """Derived classes with a state repeat this as ``state: State``."""
    parameters: Any
    """Derived classes with parameters repeat this as ``parameters: Parameters``."""

    def __init__(self, parameters: msgspec.Struct | None = None) -> None:
        self.parameters = self.Parameters() if parameters is None else parameters
        self.debug: Debug = UNSEEN
        """Its debug views; they cost nothing unless a console watches them."""
        self.reset()

    def reset(self) -> None:
        """Return to the state of a new module.

        When: at the creation of the module, and before its unit begins again. What: set every attribute that ``update``
        changes. A class that declares ``State`` and keeps nothing else needs no ``reset`` of its own.

        Raises:
            WrongDeclaration: ``State`` cannot be made without arguments.
        """
        try:
            self.state = self.State()
        except TypeError as error:
            told = f"{type_name(self.State)} cannot be made: {error}"
            raise WrongDeclaration(told, remedy="Give each field of State a default.") from error

    def is_ready(self) -> bool:
        """Return whether the module's outputs are good enough to use.

        When: after each update while it runs beside the module that it should replace. Override it if the first outputs
        after ``reset`` are poor, such as those of a running average.
        """
        return True

    def update(self, inputs: Any) -> Any:
        """Return the ``Outputs`` for these ``Inputs``.

        When: once in each round in which no required input is missing. Not: read a clock, wait, send, start tasks, or
        change an input, because other modules have the same object.
        """
        raise NotImplementedError

    @classmethod
    def ports(cls) -> ModulePorts:
        """Return the declared ports.

        Raises:
            WrongDeclaration: A port cannot be read from its declaration, or no unit could call ``update``.
        """
        declared = ModulePorts(ports_of(cls.Inputs), ports_of(cls.Outputs))
        _check_update(cls)
        return declared


def _check_update(kind: type[Module]) -> None:
    """Raise unless a unit can call ``update`` of this class and get its outputs."""
    update = inspect.getattr_static(kind, "update").__get__(object(), kind)
    try:
        inspect.signature(update).bind(None)
        wrong = ""
    except TypeError as error:
        wrong = f": {error}"
    if kind.update is Module.update:
        wrong = " is not declared"
    elif inspect.iscoroutinefunction(update):
        wrong = " is an async function, and a unit does not await it"
    if wrong:
        raise WrongDeclaration(
            f"update of {type_name(kind)}{wrong}",
            remedy="Write it as 'def update(self, inputs)'; it returns the outputs.",
        )
    for fault in (*class_faults(kind), *untyped_fields(kind.Parameters), *untyped_fields(kind.State)):
        raise WrongDeclaration(f"{type_name(kind)}: {fault}", remedy="Mend the class.")


def default_name(kind: type[Module]) -> str:
    """Return the default name of a module, derived from its class.

    Example:
        >>> default_name(type("FrameAveraging", (Module,), {}))
        'frame-averaging'
    """
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", kind.__name__).lower().strip("_")
