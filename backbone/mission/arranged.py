"""The answer of the class that runs execution units to a mission's modules: are they connected, and how?"""

from __future__ import annotations

import msgspec

CLASS = "class"  # as a port: the fault is about the module's class


class UnitFault(msgspec.Struct, frozen=True):
    """Something that does not fit.

    Attributes:
        unit: The unit that it is about; empty: see the module or the key.
        module: The module that it is about.
        port: An input, output or parameter of the module, or ``CLASS``.
        given: A key that is given from outside.
        quality: A key whose quality is declared.
        message: A sentence with the names.
        remedy: What to do.
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
    """How are these units connected?

    Attributes:
        class_path: The class that runs units.
        units: Name, frequency, modules and so on of each, as its class reads them.
        given: Key → class and source of what comes from outside.
        qualities: Key → how its values travel, where it is not as for all outputs.
    """

    class_path: str
    units: tuple[dict[str, object], ...]
    given: dict[str, dict[str, object]]
    qualities: dict[str, dict[str, object]] = {}
