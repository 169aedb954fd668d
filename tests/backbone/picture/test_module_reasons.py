"""``why`` of a module: what it waits for, or why its unit does not run it."""

from __future__ import annotations

from typing import Any

import pytest

from backbone.addresses import LAUNCHER, NAMESERVER, PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.messages import ComponentState, LifeState
from backbone.creator.messages import ListProcesses, Processes, ProcessState, Spawn
from backbone.errors import BackboneError
from backbone.exchange import UnknownModule
from backbone.mission.model import EXECUTION_UNIT
from backbone.module_waits import AskModule, AwaitedInput, ModuleWaits
from backbone.nameserver.messages import Components, ListComponents, Resolve, UnknownName
from backbone.naming import Subsystem
from backbone.picture.module_reasons import module_lines
from backbone.picture.reasons import reasons_for
from backbone.placer.messages import AskDeclared, DeclaredOrder, ListPlacements, Placements, Start
from backbone.wire import Accepts

GRABBER = ComponentState("resource_pool/grabber", "framegrabber", "base", 8, LifeState.READY, 1.0)
HEARING = Spawn(
    Subsystem.MISSION_CONTROL,
    "hearing",
    EXECUTION_UNIT,
    "x:Y",
    {"modules": [{"name": "of-hearing", "class_path": "x:Z"}]},
)
UNIT = ComponentState("mission_control/vision", EXECUTION_UNIT, "base", 7, LifeState.READY, 1.0)
PICTURE = AwaitedInput("picture", GRABBER.address, has_come=False, is_late=True)
BALL = AwaitedInput("ball", "finding", has_come=True, is_late=False)
IS_MODULE = "tracking is a module of vision, which is ready on base; it "


@pytest.mark.parametrize(
    ("waits", "lines"),
    [
        (ModuleWaits(3, [BALL], True, 4.5), ["has run 3 times", "it computes since 4.500 s"]),
        (ModuleWaits(3, [], needs_all=False), ["has run 3 times", "it has its inputs, and runs in the next round"]),
        (
            ModuleWaits(0, [PICTURE, BALL], needs_all=True),
            [
                "has not run yet",
                "it waits for the first picture, from grabber; it is late",
                "it waits for the next ball, from module finding of its unit",
            ],
        ),
        (
            ModuleWaits(1, [BALL, AwaitedInput("map", "mission_control/plan/map", True, False)], needs_all=False),
            [
                "has run 1 time",
                "one of these is enough: it waits for the next ball, from module finding of its unit",
                "one of these is enough: it waits for the next map, from plan, which is absent",
            ],
        ),
    ],
)
def test_a_module_says_what_it_waits_for(waits: ModuleWaits, lines: list[str]) -> None:
    first, *others = lines
    assert module_lines("tracking", UNIT, waits, {GRABBER.address}) == [
        IS_MODULE + first,
        *(f"  {one}" for one in others),
    ]


def why(name: str) -> list[str]:
    """Return the reasons in a mission with a unit that runs, and one whose process has fallen."""

    async def answer(asked: Any) -> Any:
        match asked.body:
            case ListComponents():
                return Components([UNIT, GRABBER], True, 0.0, [])
            case Resolve(name=unknown):
                raise UnknownName(f"no component is registered as {unknown!r}")
            case ListProcesses():
                return Processes("base", [], [ProcessState(HEARING, 0, 3, "killed by SIGKILL")])
            case AskModule("tracking"):
                return ModuleWaits(0, [PICTURE], needs_all=True)
            case ListPlacements():
                return Placements([], {"hearing": "by ann", "smelling": "by ann"})
            case AskDeclared(name=stopped):
                order = Start(EXECUTION_UNIT, stopped, {"modules": [{"name": f"nose-of-{stopped}"}]})
                return DeclaredOrder(order if stopped == "smelling" else None)
            case AskModule(module):
                raise UnknownModule(f"vision has no module {module!r}")
            case _:
                raise AssertionError(f"{asked.body} is not expected")

    async def main() -> list[str]:
        network, clock = LocalNetwork("m"), VirtualClock()
        serves: dict[str, Accepts] = {NAMESERVER: ListComponents | Resolve, LAUNCHER: ListProcesses | AskDeclared}
        serves |= {PLACER: ListPlacements, UNIT.address: AskModule}
        for address, accepts in serves.items():
            network.join(address, clock).serve(address, accepts, answer)
        return (await reasons_for(network.join("ui_console/asker", clock), name, clock)).lines(5.0)

    return run_virtual(main())


def test_a_module_of_a_running_unit_is_found() -> None:
    assert why("tracking") == [
        IS_MODULE + "has not run yet",
        "  it waits for the first picture, from grabber; it is late",
    ]


def test_a_module_of_a_fallen_unit_is_explained_by_its_fall() -> None:
    first, second = why("of-hearing")
    assert first == "of-hearing is a module of hearing, which does not run it"
    assert second.startswith("  hearing is absent for ")


def test_a_module_of_a_stopped_unit_is_explained_by_the_stop() -> None:
    start = "scout-backbone start execution_unit --name smelling"
    assert why("nose-of-smelling") == [
        f"nose-of-smelling is a module of smelling, which was stopped, by ann; start it by '{start}'"
    ]


def test_a_name_that_is_no_module_stays_unknown() -> None:
    with pytest.raises(BackboneError):
        why("nobody")
