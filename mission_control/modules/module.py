"""Module: an algorithm with declared inputs and outputs, which knows neither bus nor clock.

Derive, declare ``Inputs`` and ``Outputs``, override ``update``. What a module keeps between two updates it sets in
``reset``, or declares as ``State``. A module is tried in three lines::

    averaging = Averaging(Averaging.Parameters(count=2))
    averaging.update(Averaging.Inputs(Number(1.0)))
    assert averaging.update(Averaging.Inputs(Number(2.0))) == Averaging.Outputs(Number(1.5))

Source: RoboFrame 2006, section III: modules in threads, connected by key and type.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

import msgspec

from mission_control.modules.ports import ModulePorts, Ports, ports_of

if TYPE_CHECKING:  # most modules see no pictures and stay without NumPy
    import numpy as np
    from numpy.typing import NDArray


class Debug(Protocol):
    """Where a module shows named pictures and values; see ``mission_control.debug_views.DebugViews``."""

    def picture(self, view: str, make: Callable[[], NDArray[np.generic]]) -> None:
        """Show a picture; ``make`` is called at once if a console looks, else never."""

    def value(self, view: str, value: float | bool | str) -> None:
        """Show a value."""


class Unseen:
    """The debug views of a module outside a mission: nothing is made."""

    def picture(self, view: str, make: Callable[[], NDArray[np.generic]]) -> None:
        """Do nothing."""

    def value(self, view: str, value: float | bool | str) -> None:
        """Do nothing."""


UNSEEN = Unseen()


class Module:
    """Base of every module.

    A derived class declares the classes that it needs; the others are empty.

    Args:
        parameters: Its ``Parameters``; left out: their defaults.
    """

    class Inputs(Ports):
        """What ``update`` gets; see ``ports``."""

    class Outputs(Ports):
        """What ``update`` returns; see ``ports``."""

    class Parameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
        """Values that a mission file can set; with defaults, or else the file must give them."""

    class State(msgspec.Struct):
        """What it keeps between two updates and hands over when it is exchanged; each field has a default."""

    state: Any
    """Derived classes with a state repeat this as ``state: State``."""
    parameters: Any
    """Derived classes with parameters repeat this as ``parameters: Parameters``."""

    def __init__(self, parameters: msgspec.Struct | None = None) -> None:
        self.parameters = self.Parameters() if parameters is None else parameters
        self.debug: Debug = UNSEEN
        """Its debug views; they cost nothing unless a console looks."""
        self.reset()

    def reset(self) -> None:
        """Forget everything: afterwards the module is as it was when it was made.

        When: at the begin of its life, and before its unit begins anew. What: set every attribute that ``update``
        changes. A class that declares ``State`` and keeps nothing else needs no ``reset`` of its own.
        """
        self.state = self.State()

    def is_ready(self) -> bool:
        """Return whether its outputs are good enough to use.

        When: after each update while it runs beside the module that it is to replace. Override it if the first outputs
        after ``reset`` are poor, such as those of a running average.
        """
        return True

    def update(self, inputs: Any) -> Any:
        """Return the ``Outputs`` for these ``Inputs``.

        When: once in each round in which its required inputs are there. Not: read a clock, wait, send, start tasks, or
        change an input, which others see as well.
        """
        raise NotImplementedError

    @classmethod
    def ports(cls) -> ModulePorts:
        """Return the declared ports.

        Raises:
            WrongDeclaration: They cannot be read.
        """
        return ModulePorts(ports_of(cls.Inputs), ports_of(cls.Outputs))


def default_name(kind: type[Module]) -> str:
    """Return the name of a module that is given none: its class's.

    Example:
        >>> default_name(type("FrameAveraging", (Module,), {}))
        'frame-averaging'
    """
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "-", kind.__name__).lower().strip("_")
