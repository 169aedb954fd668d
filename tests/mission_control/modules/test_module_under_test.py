"""A module that breaks a rule is found; one that keeps them is fed as by hand."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from sample_modules import Counter, Doubler, Number, Sum, Summing

from backbone.ranges import Bulk, Pixels
from backbone.wire import MAX_LARGE_MESSAGE_BYTES, MAX_MESSAGE_BYTES, Message
from mission_control.laboratory.module_kit.graph_under_test import GraphUnderTest
from mission_control.laboratory.module_kit.module_under_test import MakeModule, ModuleRuleBroken, ModuleUnderTest
from mission_control.modules.graph import GraphRefused
from mission_control.modules.module import Module
from mission_control.modules.orders import WrongModule
from mission_control.modules.ports import LATEST


class Grey(Module):
    """Takes an array, a list or pixels; derived modules break a rule each."""

    class Inputs(Module.Inputs):
        picture: Annotated[NDArray[np.uint8] | None, LATEST] = None
        row: Annotated[list[int] | None, LATEST] = None

    class Outputs(Module.Outputs):
        row: list[int]
        number: Number | None = None

    def reset(self) -> None:
        self.row = [0]

    def update(self, inputs: Any) -> Any:
        return self.Outputs([1])


class Whitens(Grey):
    def update(self, inputs: Any) -> Any:
        inputs.picture[0] = 255
        return self.Outputs([1])


class Appends(Grey):
    def update(self, inputs: Any) -> Any:
        inputs.row.append(1)
        return self.Outputs([1])


class KeepsItsOutput(Grey):
    def update(self, inputs: Any) -> Any:
        self.row.append(1)
        return self.Outputs(self.row)


class WritesInTurn(Grey):
    """Has two buffers, and another module may still have the one that it fills again."""

    def reset(self) -> None:
        self.rows = [[0], [0]]

    def update(self, inputs: Any) -> Any:
        self.rows.reverse()
        self.rows[0].append(1)
        return self.Outputs(self.rows[0])


class SaysNothing(Grey):
    def update(self, inputs: Any) -> Any:
        return None


class LeavesOut(Grey):
    def update(self, inputs: Any) -> Any:
        return self.Outputs(None)  # type: ignore[arg-type]


class SaysSomethingElse(Grey):
    def update(self, inputs: Any) -> Any:
        return self.Outputs([1], Sum(1.0))  # type: ignore[arg-type]


class CannotCross(Grey):
    def update(self, inputs: Any) -> Any:
        return self.Outputs([1], Number("one"))  # type: ignore[arg-type]


class SendsMethod(Grey):
    def update(self, inputs: Any) -> Any:
        return self.Outputs([1], Number({1.0}.pop))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("kind", "says"),
    [
        (Whitens, "whitens changed picture of"),
        (Appends, "appends changed row of"),
        (KeepsItsOutput, "keeps-its-output changed row of"),
        (WritesInTurn, "writes-in-turn changed row of"),
        (SaysNothing, "says-nothing returns builtins:NoneType"),
        (LeavesOut, "output row of leaves-out is builtins:NoneType, declared is list"),
        (SaysSomethingElse, "output number of says-something-else is sample_modules:Sum, declared is .*Number"),
        (CannotCross, "output number of cannot-cross cannot cross the bus: .* got `str`"),
        (SendsMethod, "output number of sends-method cannot cross the bus: Encoding objects of type"),
    ],
)
def test_a_broken_rule_is_found(module_under_test: MakeModule, kind: type[Module], says: str) -> None:
    module = module_under_test(kind())

    def thrice() -> None:
        for _ in range(3):
            module.update(picture=np.zeros(3, np.uint8), row=[0])

    with pytest.raises(ModuleRuleBroken, match=says):
        thrice()


def test_inputs_that_are_not_declared_are_refused(module_under_test: MakeModule) -> None:
    doubler = module_under_test(Doubler())
    with pytest.raises(ModuleRuleBroken, match=r"has no input 'numbr' .did you mean 'number'"):
        doubler.update(numbr=Number(1.0))
    with pytest.raises(ModuleRuleBroken, match="waits for its input number"):
        doubler.update()
    with pytest.raises(ModuleRuleBroken, match="input number of doubler is sample_modules:Sum"):
        doubler.update(number=Sum(1.0))
    with pytest.raises(ModuleRuleBroken, match="input number of doubler is builtins:NoneType"):
        doubler.update(number=None)


class Picture(Message, frozen=True):
    pixels: Pixels


class Inverts(Module):
    class Inputs(Module.Inputs):
        picture: Picture

    class Outputs(Module.Outputs):
        picture: Picture

    in_place = False

    def update(self, inputs: Any) -> Any:
        pixels = np.frombuffer(inputs.picture.pixels, np.uint8)
        return self.Outputs(Picture(memoryview(np.subtract(255, pixels, out=pixels if self.in_place else None))))


class Map(Message, frozen=True):
    heights: Bulk


class Maps(Module):
    class Outputs(Module.Outputs):
        map: Map

    class Parameters(Module.Parameters, frozen=True):
        bytes: int

    def update(self, inputs: Any) -> Any:
        return self.Outputs(Map(memoryview(bytes(self.parameters.bytes))))


def test_a_large_output_is_as_long_as_a_host_admits(module_under_test: MakeModule) -> None:
    assert len(module_under_test(Maps(Maps.Parameters(MAX_MESSAGE_BYTES))).update().map.heights) == MAX_MESSAGE_BYTES
    with pytest.raises(ModuleRuleBroken, match="output map of maps cannot cross the bus: Map of 67108"):
        module_under_test(Maps(Maps.Parameters(MAX_LARGE_MESSAGE_BYTES))).update()


class Mirrors(Inverts):
    def update(self, inputs: Any) -> Any:
        return self.Outputs(Picture(inputs.picture.pixels[::-1]))


def test_pixels_that_are_not_one_after_the_other_break_a_rule(module_under_test: MakeModule) -> None:
    with pytest.raises(ModuleRuleBroken, match=r"picture of mirrors cannot cross the bus: .* not C-contiguous"):
        module_under_test(Mirrors()).update(picture=Picture(memoryview(bytearray(3))))


def test_pixels_of_a_message_must_not_be_changed_either(module_under_test: MakeModule) -> None:
    inverts = module_under_test(Inverts())
    assert inverts.update(picture=Picture(memoryview(bytearray(3)))).picture.pixels == b"\xff" * 3
    inverts.module.in_place = True
    with pytest.raises(ModuleRuleBroken, match="inverts changed picture of"):
        inverts.update(picture=Picture(memoryview(bytearray(3))))


class Forgetful(Counter):
    count: float = 0.0

    def reset(self) -> None:
        """Forgets nothing."""

    def update(self, inputs: Any) -> Any:
        self.count += 1
        return self.Outputs(Number(self.count))


def test_a_reset_that_forgets_to_forget_is_found(module_under_test: MakeModule) -> None:
    for kind, keeps_the_rule in ((Counter, True), (Forgetful, False)):
        module = module_under_test(kind())
        module.update()
        if keeps_the_rule:
            module.check_reset()
        else:
            with pytest.raises(ModuleRuleBroken, match="update 1 of forgetful says something else after a reset"):
                module.check_reset()


def test_a_class_in_place_of_a_module_is_refused_and_stays_as_it_is(
    module_under_test: MakeModule, module_graph: type[GraphUnderTest]
) -> None:
    """Its update was replaced for all later tests of the session."""
    update: object = Doubler.update
    for make in (module_under_test, module_graph):
        with pytest.raises(WrongModule, match="is no module"):
            make(Doubler)  # type: ignore[arg-type]
    assert Doubler.update is update


def test_what_a_module_shows_is_seen(module_under_test: MakeModule) -> None:
    doubler = module_under_test(Doubler())
    doubler.update(number=Number(1.0))
    assert doubler.shown == {"factor": 2.0}


@given(st.lists(st.floats(-1e6, 1e6), min_size=1))
def test_a_watched_module_says_what_it_says_alone(numbers: list[float]) -> None:
    watched, alone = ModuleUnderTest(Doubler()), Doubler()
    for number in map(Number, numbers):
        assert watched.update(number=number) == alone.update(Doubler.Inputs(number))
    watched.check_reset()


@given(st.lists(st.one_of(st.floats(0.01, 2.0), st.just("feed")), max_size=30))
def test_a_graph_runs_every_round_that_began_and_no_other(steps: list[float | str]) -> None:
    graph = GraphUnderTest(Doubler(), Summing(), given=["number"], frequency_hz=10.0)
    for step in steps:
        if isinstance(step, float):
            graph.advance(step)
        else:
            graph.feed("number", Number(1.0))
    assert len(graph.made["twice"]) == steps.count("feed")
    assert graph.statistics().missed == 0
    assert graph.statistics().ticks == pytest.approx(10.0 * graph.now_s, abs=1.0)


@pytest.mark.parametrize("for_s", [-1.0, float("nan"), float("inf")])
def test_virtual_time_passes_forwards_only(for_s: float) -> None:
    graph = GraphUnderTest(Doubler(), given=["number"], frequency_hz=1.0)
    graph.advance(2.0)
    with pytest.raises(ModuleRuleBroken, match="time cannot advance by"):
        graph.advance(for_s)
    assert graph.now_s == 2.0


def test_a_graph_is_fed_what_its_modules_take() -> None:
    with pytest.raises(ModuleRuleBroken, match=r"no module takes 'numbr' .did you mean 'number'"):
        GraphUnderTest(Doubler(), given=["number", "numbr"])
    graph = GraphUnderTest(Grey(), given=["picture"], frequency_hz=1.0)
    for wrong in (Number(1.0), None):
        with pytest.raises(ModuleRuleBroken, match="input picture of grey is"):
            graph.feed("picture", wrong)  # at once, not in a later round
    assert graph.statistics().rounds == 0


def test_a_graph_is_checked_and_its_modules_are_watched(module_graph: type[GraphUnderTest]) -> None:
    with pytest.raises(GraphRefused, match="doubler needs number"):
        module_graph(Doubler())
    with pytest.raises(ModuleRuleBroken, match="changed row"):
        module_graph(KeepsItsOutput(), frequency_hz=10.0).advance(1.0)


class Measure(Module):
    class Outputs(Module.Outputs):
        length: float
        about: Any

    def update(self, inputs: Any) -> Outputs:
        return self.Outputs(1, {"unit": "m"})


def test_what_a_unit_takes_the_kit_takes_too(module_under_test: MakeModule) -> None:
    assert module_under_test(Measure()).update() == Measure.Outputs(1, {"unit": "m"})
