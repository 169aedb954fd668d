"""Choice: algorithms for one task run side by side, and one of them provides the values of a key.

A ``SourceChoice`` is an ordinary module: the graph checks its classes, orders it, and connects it to other units. Its
parameters determine its ports.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any

import msgspec

from backbone.naming import did_you_mean
from mission_control.modules.graph import NoProducer, WiringFault, WrongType
from mission_control.modules.module import Module
from mission_control.modules.orders import ModuleOrder, load_at
from mission_control.modules.ports import Key, type_name

CLASS_PATH = "mission_control.modules.choice:SourceChoice"


class ChoiceOrder(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A choice of a mission file.

    Attributes:
        key: The key that gets the values.
        source: The key that provides the values at first.
        others: Keys that can be chosen instead.
    """

    key: str
    source: str
    others: list[str] = []

    @property
    def name(self) -> str:
        """Name of the choosing module."""
        return f"choose-{self.key}"

    @property
    def sources(self) -> list[str]:
        """All keys that can be chosen, the initial one first."""
        return [self.source, *(key for key in self.others if key != self.source)]

    def order(self, kind: object) -> ModuleOrder:
        """Return the module, for values of this class."""
        return ModuleOrder(self.name, CLASS_PATH, {"of": type_name(kind), "key": self.key, "sources": self.sources})


class SourceChoice(Module):
    """Passes the values of the chosen source on when they arrive."""

    class Parameters(Module.Parameters, frozen=True):
        """Parameters of ``SourceChoice``.

        Attributes:
            of: Class of the values, ``package.module:Class``.
            key: Key of the output.
            sources: Keys of the inputs; initially the first is chosen.
        """

        of: str
        key: str
        sources: list[str]

    parameters: Parameters

    def __new__(cls, parameters: Parameters) -> SourceChoice:
        """Return a module of a class with these ports.

        Raises:
            WrongModule: The class path does not exist.
        """
        kind: Any = load_at(parameters.of)
        fields = [(f"from_{n}", Annotated[kind | None, Key(key)], None) for n, key in enumerate(parameters.sources)]
        inputs = msgspec.defstruct("Inputs", fields, bases=(Module.Inputs,))
        output = ("chosen", Annotated[kind | None, Key(parameters.key)], None)
        outputs = msgspec.defstruct("Outputs", [output], bases=(Module.Outputs,))
        return object.__new__(type(cls.__name__, (cls,), {"Inputs": inputs, "Outputs": outputs}))

    def __init__(self, parameters: Parameters) -> None:
        super().__init__(parameters)
        self.chosen = parameters.sources[0]
        """The source; settable, also during a round."""

    def update(self, inputs: Any) -> Any:
        """Return the chosen source's value, if it has a new one."""
        chosen = self.chosen
        self.debug.value("source", chosen)
        return self.Outputs(getattr(inputs, f"from_{self.parameters.sources.index(chosen)}"))


def choice_faults(choices: Sequence[ChoiceOrder], kinds: Mapping[str, object]) -> Iterator[WiringFault]:
    """Yield the faults of sources.

    Args:
        kinds: Key → class of the values of each key that has a producer.
    """
    for choice in choices:
        for key in choice.sources:
            if key not in kinds:
                detail = f"{choice.key} can be chosen from {key}, and no module produces it{did_you_mean(key, kinds)}"
                yield NoProducer((choice.name,), "from", detail, "Name keys that modules produce, or that are given")
            elif not isinstance(kinds[key], type):
                detail = f"{choice.key} can be chosen from {key}, and {type_name(kinds[key])} is no class"
                yield WrongType((choice.name,), "from", detail, "Declare the port with a class")
