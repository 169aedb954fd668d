"""Choices of operators: other rules of the RC manager, changes of a mission that is up, and emergency stops.

They are among the faults of a mission, because a mission must keep its laws with them, and because a broken run is
repeated with some of them. The id of a choice is its time and target.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from random import Random

from backbone.addresses import RC_MANAGER
from backbone.bus.interface import Bus, Clock
from backbone.component.messages import SetParameter
from backbone.errors import LinkError, Refusal
from backbone.naming import Subsystem, address, component_of
from backbone.rc_manager.messages import MoveNode, SetPriority
from backbone.scheduling.response_time import Analysis
from backbone.wire import Message
from mission_control.laboratory.simulation.audit import Audit
from mission_control.laboratory.simulation.shape import BRING_UP_S, MISSION, MissionShape
from resource_pool.robot_stops import lift_stop, stop_robot

OPERATOR = "ui_console/operator"
WITHIN_S = 1.0  # chosen: every component answers at once, if at all
MOST_CHANGES = 4  # chosen: a later change meets the effects of an earlier one
CAPACITIES = (0.3, 0.5, 1.0)  # chosen: each serves one owner alone, so none waits for ever
PRIORITIES = (1, 2, 3, 20)  # chosen: those of the tree, and one above the mission among the consoles
AGINGS_S = (0.0, 3.0)  # chosen: longer than every minimum run time: a shorter one lets equals override each other
GRIDS_S = (0.0, 0.0, 0.5)  # chosen: as long as a short slice


@dataclass(frozen=True, slots=True)
class OtherRules:
    """Rules of the RC manager in the mission file.

    Not the discipline ``time``: with it the order of ARCs changes as time passes, also without an event.
    """

    admission: Analysis = "exact"
    aging_s: float = 0.0
    grid_s: float = 0.0
    at_s: float = 0.0
    target: str = component_of(RC_MANAGER)

    @property
    def over_s(self) -> float:
        """Mission time of its end."""
        return self.at_s

    def parameters(self) -> dict[str, object]:
        """Return the rules as parameters of the RC manager."""
        return {"admission": self.admission, "aging_s": self.aging_s, "grid_s": self.grid_s}

    def __str__(self) -> str:
        return f"{self.target} has admission {self.admission}, aging {self.aging_s:g} s, grid {self.grid_s:g} s"


@dataclass(frozen=True, slots=True)
class OperatorChange:
    """A change of a mission that is up.

    Attributes:
        target: Changed node, console or radio.
        value: Its new priority, parent or capacity.
    """

    at_s: float
    target: str
    value: int | str | float

    @property
    def receiver(self) -> str:
        """Address of the component that makes the change."""
        return address(Subsystem.RESOURCE_POOL, self.target) if isinstance(self.value, float) else RC_MANAGER

    def message(self) -> Message:
        """Return the operator's question."""
        match self.value:
            case int(priority):
                return SetPriority(self.target, priority)
            case str(parent):
                return MoveNode(self.target, parent)
            case capacity:
                return SetParameter("capacity", capacity)

    @property
    def over_s(self) -> float:
        """Mission time of its end."""
        return self.at_s

    def __str__(self) -> str:
        match self.value:
            case int(priority):
                what = f"the priority {priority}"
            case str(parent):
                what = f"the parent {parent}"
            case capacity:
                what = f"the capacity {capacity:g}"
        return f"an operator gives {self.target} {what} at {self.at_s:.3f} s"


@dataclass(frozen=True, slots=True)
class RobotStop:
    """An emergency stop of a robot, which is lifted after a while.

    Attributes:
        target: The robot's RC.
    """

    at_s: float
    target: str
    lasts_s: float

    @property
    def over_s(self) -> float:
        """Mission time of its end."""
        return self.at_s + self.lasts_s

    def __str__(self) -> str:
        return f"an operator stops {self.target} at {self.at_s:.3f} s for {self.lasts_s:.3f} s"


def draw_choices(shape: MissionShape, nodes: Sequence[str]) -> list[OtherRules | OperatorChange]:
    """Return the choices for this mission; half of the missions have other rules, half of them changes.

    Args:
        nodes: Nodes of the behavior tree.
    """
    dice = Random(f"operator {shape.seed}")
    admission: Analysis = dice.choice(("exact", "sum"))
    rules = OtherRules(admission, dice.choice(AGINGS_S), dice.choice(GRIDS_S))
    changes = [_draw(dice, shape, nodes) for _ in range(dice.randint(1, MOST_CHANGES))]
    return [*([rules] if dice.random() < 0.5 else []), *(changes if dice.random() < 0.5 else [])]


def _draw(dice: Random, shape: MissionShape, nodes: Sequence[str]) -> OperatorChange:
    at_s = round(dice.uniform(BRING_UP_S, shape.active_s), 6)
    consoles = [owner.name for owner in shape.owners if owner.console]
    match dice.choice(("priority", "priority", "parent", "capacity")):
        case "parent" if nodes:
            return OperatorChange(at_s, dice.choice(nodes), dice.choice((MISSION, *nodes)))
        case "capacity":
            radios = [resource.name for resource in shape.resources if resource.sharable]
            return OperatorChange(at_s, dice.choice(radios), dice.choice(CAPACITIES))
        case _:
            return OperatorChange(at_s, dice.choice((*consoles, *nodes)), dice.choice(PRIORITIES))


def draw_stops(shape: MissionShape) -> list[RobotStop]:
    """Return the emergency stops of this mission, at most two; half of the missions have none."""
    dice = Random(f"stops {shape.seed}")
    robots = [resource.name for resource in shape.resources if resource.type == "scout"]
    number = dice.choice((0, 0, 1, 2))
    return [
        RobotStop(
            round(dice.uniform(BRING_UP_S, shape.active_s), 6), dice.choice(robots), round(dice.uniform(0.1, 6.0), 3)
        )
        for _ in range(number)
    ]


async def stop_and_lift(stop: RobotStop, bus: Bus, clock: Clock, audit: Audit) -> None:
    """Stop the robot; if it has confirmed the order, lift the stop later, until that is confirmed."""
    robot = stop.target
    try:
        state = await stop_robot(bus, robot, "simulated", clock=clock)
    except LinkError:
        audit.note("operator", "stop unconfirmed", robot=robot)
        return
    audit.note("operator", "stops", robot=robot, is_confirmed=state.is_confirmed)
    await clock.sleep_s(stop.lasts_s)
    audit.note("operator", "lifts", robot=robot)
    while True:
        try:
            await lift_stop(bus, state)
        except LinkError:
            await clock.sleep_s(WITHIN_S)
        except Refusal as newer:
            audit.note("operator", "not lifted", robot=robot, how=type(newer).__name__)
            return
        else:
            audit.note("operator", "lifted", robot=robot)
            return


async def carry_out(change: OperatorChange, bus: Bus, audit: Audit) -> None:
    """Make the change; record its outcome."""
    try:
        await bus.ask(change.receiver, change.message(), Message, within_s=WITHIN_S)
    except Refusal as refusal:
        audit.note("operator", "refused", change=str(change), how=type(refusal).__name__)
    except LinkError:
        audit.note("operator", "unconfirmed", target=change.target, value=change.value)
    else:
        audit.note("operator", "changed", target=change.target, value=change.value)
