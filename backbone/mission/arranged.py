"""How the class that runs execution units connects a mission's modules, or why it cannot connect them."""

from __future__ import annotations

import msgspec

CLASS = "class"  # as a port: the fault is in the module's class


class UnitFault(msgspec.Struct, frozen=True):
    """A fault in the connections of modules.

    Attributes:
        unit: The faulty unit; empty: see the module or the key.
        module: The faulty module.
        port: An input, output or parameter of the module, or ``CLASS``.
        given: A key that is given from outside.
        quality: A key whose quality is declared.
        message: A sentence with the names.
        remedy: How to correct the fault.
    """

    message: str
    remedy: str
    unit: str = ""
    module: str = ""
    port: str = ""
    given: str = ""
    quality: str = ""


class Arranged(msgspec.Struct, frozen=True):
    """The arrangement of a mission's units.

    Attributes:
        parameters: Unit → parameters of its component; none if there are faults.
    """

    parameters: dict[str, dict[str, object]] = {}
    faults: tuple[UnitFault, ...] = ()


class UnitsQuestion(msgspec.Struct, frozen=True):
    """A question to the class that runs units: how are these units connected?

    Attributes:
        class_path: The class that runs units.
        units: Name, frequency, modules and so on of each unit, in the form that the class reads.
        given: Key → class and source of values that are given from outside.
        qualities: Key → quality of its values, if it differs from the default for outputs.
    """

    class_path: str
    units: tuple[dict[str, object], ...]
    given: dict[str, dict[str, object]]
    qualities: dict[str, dict[str, object]] = {}
