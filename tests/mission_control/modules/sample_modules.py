"""Small modules for tests: numbers go in, numbers come out."""

from __future__ import annotations

from typing import Annotated

from backbone.wire import Message
from mission_control.modules.module import Module
from mission_control.modules.ports import LATEST, Key


class Number(Message, frozen=True):
    value: float


class Sum(Message, frozen=True):
    value: float


class Counter(Module):
    """Counts its rounds."""

    class Outputs(Module.Outputs):
        number: Number

    class Parameters(Module.Parameters, frozen=True):
        step: float = 1.0

    parameters: Parameters

    def reset(self) -> None:
        self.count = 0.0

    def update(self, inputs: Module.Inputs) -> Outputs:
        self.count += self.parameters.step
        return self.Outputs(Number(self.count))


class Doubler(Module):
    class Inputs(Module.Inputs):
        number: Number

    class Outputs(Module.Outputs):
        twice: Number

    def update(self, inputs: Inputs) -> Outputs:
        self.debug.value("factor", 2.0)
        return self.Outputs(Number(2 * inputs.number.value))


class Summing(Module):
    """Adds up all numbers, and says the sum of every second one."""

    class Inputs(Module.Inputs):
        summand: Annotated[Number, Key("twice")]

    class Outputs(Module.Outputs):
        sum: Sum | None = None

    def reset(self) -> None:
        self.total, self.is_odd = 0.0, False

    def update(self, inputs: Inputs) -> Outputs:
        self.total, self.is_odd = self.total + inputs.summand.value, not self.is_odd
        return self.Outputs() if self.is_odd else self.Outputs(Sum(self.total))


class Follower(Module):
    """Goes a part of the way to the sum, from where it was: its own output is a latest value."""

    class Inputs(Module.Inputs):
        sum: Sum
        last: Annotated[Number, LATEST, Key("place")] = Number(0.0)

    class Outputs(Module.Outputs):
        place: Number

    def update(self, inputs: Inputs) -> Outputs:
        return self.Outputs(Number(inputs.last.value + 0.5 * (inputs.sum.value - inputs.last.value)))
