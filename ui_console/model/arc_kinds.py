"""Chooses the kind of ARC that a console claims for a robot. Pure."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from backbone.component_database.messages import ComponentType
from backbone.dependency_database.messages import Resource
from backbone.errors import Refusal
from backbone.naming import did_you_mean
from ui_console.model.profile import Sight

NAME_ONE = "Use one of these names, or add the robot to the mission file."


class NoArcKind(Refusal):
    """No kind of ARC of this mission drives the robot."""

    code = "console.no_arc_kind"
    remedy = "Declare an ARC kind for it in the mission file (docs/how-to/add-a-robot.md), or name one by --kind."


def arc_kind(robot: str, sight: Sight, types: Sequence[ComponentType], resources: Collection[Resource]) -> str:
    """Return the kind of ARC to claim: its body is this robot, and it has only the RCs that this sight needs.

    Args:
        robot: The robot, or another device that is a body of a kind; empty: any robot.
        resources: Hardware of the mission.

    Raises:
        NoArcKind: The mission has no kind for the robot.
    """
    robots = sorted(resource.name for resource in resources if resource.is_robot)
    if robot and not any(resource.name == robot for resource in resources):
        others = ", ".join(robots) or "none"
        raise NoArcKind(
            f"no robot is named {robot!r}{did_you_mean(robot, robots)}; there is {others}", remedy=NAME_ONE, robot=robot
        )
    of_robot = {resource.type for resource in resources if resource.name == robot or (not robot and resource.is_robot)}
    drives = [one for one in types if _body(one) in of_robot]
    complete = _complete(drives, resources) or drives
    if not complete:
        kinds = ", ".join(sorted(of_robot))
        if robot and robots and robot not in robots:
            told = f"{robot} is a {kinds}, which no kind of ARC has as its body; the robots are {', '.join(robots)}"
            raise NoArcKind(told, remedy="Name a robot, or a device that an ARC kind has as its body.", robot=robot)
        raise NoArcKind(f"no kind of ARC has a body of kind {kinds}" if kinds else "there is no robot", robot=robot)
    return min(complete, key=lambda one: _badness(one, sight)).name


def kinds_beside(kind: ComponentType, types: Sequence[ComponentType], resources: Collection[Resource]) -> list[str]:
    """Return the other kinds of ARC with a body of the same type for which this mission has the hardware, by name."""
    others = [one for one in types if one.name != kind.name and _body(kind) and _body(one) == _body(kind)]
    return sorted(one.name for one in _complete(others, resources))


def _body(kind: ComponentType) -> str:
    """Return the type of the body of a kind of ARC; empty: no body."""
    return kind.needs.get(kind.abilities.body, "")


def _complete(kinds: Sequence[ComponentType], resources: Collection[Resource]) -> list[ComponentType]:
    there = {resource.type for resource in resources}
    return [one for one in kinds if there.issuperset(one.needs.values())]


def _badness(kind: ComponentType, sight: Sight) -> tuple[bool, int, str]:
    """Return a sort key by which kinds that suit the sight better come first."""
    pictures, size = kind.abilities.gives_pictures, len(kind.needs)
    match sight:
        case Sight.PICTURES:
            return not pictures, -size if not pictures else size, kind.name
        case Sight.BROADCAST:
            return pictures, -size, kind.name
        case Sight.NOTHING:
            return pictures, size, kind.name
