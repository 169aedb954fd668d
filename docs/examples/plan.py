"""A planner that computes for seconds, and a follower that acts twenty times a second on the newest plan."""

from typing import Annotated

from backbone.wire import Message
from mission_control.modules.module import Module
from mission_control.modules.ports import LATEST

WIDTH, DEPTH = 80, 60  # of the floor, in cells
START, GOAL = (4.0, 4.0), (75, 4)
WALL = {(40, y) for y in range(48)}  # open at its far end
FAR = float(WIDTH * DEPTH)  # longer than every way


class Place(Message, frozen=True):
    x: float
    y: float


class Plan(Message, frozen=True):
    ways: list[Place]  # from here to the goal, cell by cell


class Planner(Module):
    """Deliberative: computes the length of the way from each cell to the goal, until no length changes any more."""

    class Inputs(Module.Inputs):
        place: Annotated[Place, LATEST] = Place(*START)

    class Outputs(Module.Outputs):
        plan: Plan

    def update(self, inputs: Inputs) -> Outputs:
        cells = [(x, y) for x in range(WIDTH) for y in range(DEPTH) if (x, y) not in WALL]
        left = {cell: 0.0 if cell == GOAL else FAR for cell in cells}
        before: dict[tuple[int, int], float] = {}
        while left != before:
            before = dict(left)
            for cell in cells:
                left[cell] = min(left[cell], 1 + min(left[one] for one in beside(cell) if one in left))
        cell, ways = (round(inputs.place.x), round(inputs.place.y)), list[Place]()
        while left.get(cell, FAR) not in (0, FAR):  # each next cell is nearer
            cell = min((one for one in beside(cell) if one in left), key=left.__getitem__)
            ways.append(Place(*map(float, cell)))
        return self.Outputs(Plan(ways))


class Follower(Module):
    """Reactive: makes a step towards the next cell of the newest plan in each round; without a plan it stays."""

    class Inputs(Module.Inputs):
        plan: Annotated[Plan | None, LATEST] = None

    class Outputs(Module.Outputs):
        place: Place

    class Parameters(Module.Parameters, frozen=True):
        step: float = 0.25

    parameters: Parameters

    def reset(self) -> None:
        self.place, self.plan, self.next = Place(*START), Plan([]), 0

    def update(self, inputs: Inputs) -> Outputs:
        if inputs.plan is not None and inputs.plan is not self.plan:
            self.plan, self.next = inputs.plan, nearest(inputs.plan, self.place)
        if self.next < len(self.plan.ways):
            to, step = self.plan.ways[self.next], self.parameters.step
            dx, dy = to.x - self.place.x, to.y - self.place.y
            length = max((dx * dx + dy * dy) ** 0.5, step)
            self.place = Place(self.place.x + dx * step / length, self.place.y + dy * step / length)
            self.next += length <= step
        return self.Outputs(self.place)


def beside(cell: tuple[int, int]) -> list[tuple[int, int]]:
    x, y = cell
    return [(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)]


def nearest(plan: Plan, place: Place) -> int:
    return min(
        range(len(plan.ways)),
        key=lambda n: (plan.ways[n].x - place.x) ** 2 + (plan.ways[n].y - place.y) ** 2,
        default=0,
    )
