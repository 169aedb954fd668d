"""Composed trees of real components, with a placer that decides nothing and ARCs that come and go, on virtual time."""

from __future__ import annotations

from typing import Any

from fake_resource_pool import FakePlacer

from backbone.component.component import Component
from backbone.component.messages import Parameters, SetParameter
from backbone.mission.behavior_orders import behavior_order
from backbone.wire import Message
from mission_control.behavior import Behavior
from mission_control.behaviors.condition import MessageCondition
from mission_control.behaviors.fallback import Fallback
from mission_control.behaviors.parallel import Parallel
from mission_control.behaviors.repeat import Repeat
from mission_control.behaviors.retry import Retry
from mission_control.behaviors.sequence import Sequence
from mission_control.behaviors.timeout import Timeout
from mission_control.behaviors.wait import Wait
from mission_control.messages import AskBehavior, BehaviorState, BehaviorStatus

ARC = {"kind": "drive", "minimum_runtime_s": 5.0, "wish": {"scout": "scout1"}}
SUCCESS, FAILURE = BehaviorStatus.SUCCESS, BehaviorStatus.FAILURE


class Leaf(Behavior[Any]):
    """Does nothing until the test ends it."""


class Battery(Message, frozen=True):
    """An event of one's own."""

    charge: float


CLASSES: dict[str, type[Component[Any]]] = {
    "leaf": Leaf,
    "sequence": Sequence,
    "fallback": Fallback,
    "parallel": Parallel,
    "retry": Retry,
    "repeat": Repeat,
    "timeout": Timeout,
    "wait": Wait,
    "condition": MessageCondition,
}


def node(kind: str, name: str, *children: dict[str, Any], arc: Any = None, **parameters: Any) -> dict[str, Any]:
    return {
        "type": kind,
        "name": name,
        "priority": 3,
        "children": list(children),
        "parameters": parameters,
        "arc": arc,
    }


async def root(placer: FakePlacer, tree: dict[str, Any]) -> Any:
    return await placer.launch(behavior_order(tree, [("iros2001", 10)]))


async def granted(placer: FakePlacer, leaf: str) -> Any:
    """Return the leaf's ARC, with its first grant."""
    await placer.wait(lambda: f"{leaf}-drive" in placer.arcs)
    arc = placer.arcs[f"{leaf}-drive"]
    await arc.grant()
    await placer.clock.sleep_s(0.1)
    return arc


async def ended(placer: FakePlacer, name: str, status: BehaviorStatus, **payload: Any) -> None:
    """End a leaf with this status, as soon as it is there."""
    await placer.wait(lambda: name in placer.components)
    leaf = placer.components[name]
    leaf.finish(status, payload)
    await placer.wait(lambda: placer.components.get(name) is not leaf)


def is_running(placer: FakePlacer, *names: str) -> bool:
    return set(placer.components) == set(names)


async def tree_of(placer: FakePlacer, name: str) -> list[str]:
    """Return the drawing of a branch."""
    state = await placer.bus.ask(f"mission_control/{name}", AskBehavior(), BehaviorState, within_s=1.0)
    return state.tree.splitlines()


async def set_parameter(placer: FakePlacer, name: str, parameter: str, value: object) -> None:
    await placer.bus.ask(f"mission_control/{name}", SetParameter(parameter, value, "anna"), Parameters, within_s=1.0)
