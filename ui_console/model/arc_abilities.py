"""Abilities of a kind of ARC for an operator: the speeds of its body, and the commands that it accepts. Pure.

Consoles generate stick, buttons, sliders and switches from the abilities. An ARC declares its commands with the roles
of the RCs that obey them; the RC declares the limits of each field.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import msgspec

from backbone.component.abilities import CommandForm, FieldForm, ValueKind
from backbone.component_database.messages import ComponentType
from backbone.dependency_database.messages import Resource
from ui_console.model.arc_kinds import kinds_beside
from ui_console.model.fields import label_of

MOVE, HALT = "move", "halt"
BY_STICK = frozenset({MOVE, "drive", HALT})
"""Words of the commands that stick, pad and keys send; each other command gets a button."""


class Reach(msgspec.Struct, frozen=True):
    """Largest speeds that a stick requests from a body.

    Attributes:
        forward_m_s: Forward speed at full stick.
        turn_rad_s: Largest turn rate on the spot.
    """

    forward_m_s: float
    turn_rad_s: float


SLOW = Reach(0.1, 1.0)  # chosen: for a robot with unknown limits; slow enough for a person to step aside


class RoleCommand(msgspec.Struct, frozen=True):
    """A command for the RC of one role, with that RC's limits.

    Attributes:
        role: Role of the RC that obeys it.
        title: For people: its words, and the role if several RCs of the ARC obey it.
        form: Its fields, without the fields that a person cannot set.
        labels: Labels of the fields with range and unit, for people.
    """

    role: str
    title: str
    form: CommandForm
    labels: list[str]


class KindChoice(msgspec.Struct, frozen=True):
    """A kind of ARC that an operator can choose.

    Attributes:
        kind: Its name.
        title: For people: its name and the roles of its RCs.
    """

    kind: str
    title: str


class ArcAbilities(msgspec.Struct, frozen=True):
    """Abilities of an ARC for an operator.

    Attributes:
        reach: Largest speeds of its body; None: the body cannot move.
        can_halt: True if it accepts a command to halt.
        commands: Commands that a person can send, without the stick's commands, in the order of their declaration.
        gives_pictures: True if consoles get pictures of its robot.
        kinds: The kinds of ARC with the same body, this ARC's kind first; empty: there is no choice.
    """

    reach: Reach | None
    can_halt: bool
    commands: list[RoleCommand]
    gives_pictures: bool = False
    kinds: list[KindChoice] = []

    def takes(self, word: str) -> bool:
        """Return whether a person can send this command."""
        return any(command.form.word == word for command in self.commands)

    def moves(self, word: str) -> bool:
        """Return whether a stopped robot refuses this command; True if the ARC does not declare the command."""
        forms = [command.form for command in self.commands if command.form.word == word]
        return not forms or any(form.moves for form in forms)


def arc_abilities(
    kind: str, types: Sequence[ComponentType], resources: Collection[Resource] = ()
) -> ArcAbilities | None:
    """Return the abilities of this kind of ARC; None: the mission has no such kind.

    Args:
        kind: Its name.
        resources: Hardware of the mission; without it there is no choice of kinds.

    Example:
        >>> arc_abilities("drive", []) is None
        True
    """
    by_name = {one.name: one for one in types}
    arc = by_name.get(kind)
    if arc is None:
        return None
    declared = arc.abilities.commands
    commands = [
        _asked(role, _title(form, role), _limited(arc, form, role, by_name))
        for form in declared
        for role in form.roles
        if form.word not in BY_STICK and not any(_is_odd(field) and field.is_required for field in form.fields)
    ]
    can_halt = any(form.word == HALT for form in declared)
    others = kinds_beside(arc, types, resources)
    kinds = [_choice(by_name[name]) for name in (kind, *others)] if others else []
    return ArcAbilities(_reach(arc, by_name), can_halt, commands, arc.abilities.gives_pictures, kinds)


def _choice(kind: ComponentType) -> KindChoice:
    words = [name.replace("_", " ") for name in (kind.name, *sorted(kind.needs))]
    return KindChoice(kind.name, f"{words[0]}: {', '.join(words[1:])}")


def _asked(role: str, title: str, form: CommandForm) -> RoleCommand:
    fields = [field for field in form.fields if not _is_odd(field)]
    asked = msgspec.structs.replace(form, fields=fields)
    return RoleCommand(role, title, asked, [label_of(field) for field in fields])


def _is_odd(field: FieldForm) -> bool:
    """Return whether a person cannot set this field."""
    return field.kind is ValueKind.OTHER


def _title(form: CommandForm, role: str) -> str:
    words = form.word.replace("_", " ")
    return f"{words} ({role})" if len(form.roles) > 1 else words


def _limited(arc: ComponentType, form: CommandForm, role: str, by_name: dict[str, ComponentType]) -> CommandForm:
    """Return the form with the limits of this role's RC; if the RC's type is unknown, the ARC's form."""
    rc = by_name.get(arc.needs.get(role, ""))
    own = [one for one in rc.abilities.commands if one.word == form.word] if rc is not None else []
    return own[0] if own else form


def _reach(arc: ComponentType, by_name: dict[str, ComponentType]) -> Reach | None:
    """Return the limits of ``move``; ``SLOW`` for a field whose limit the body's RC does not declare."""
    body = arc.abilities.body
    declared = [form for form in arc.abilities.commands if form.word == MOVE and body in form.roles]
    if not declared:
        return None
    form, limited = declared[0], _limited(arc, declared[0], body, by_name)
    forward, turn = (_most(form, limited, field) for field in ("forward_m_s", "turn_rad_s"))
    return Reach(SLOW.forward_m_s if forward is None else forward, SLOW.turn_rad_s if turn is None else turn)


def _most(form: CommandForm, limited: CommandForm, field: str) -> float | None:
    """Return the RC's limit of a field; None: only the field's type limits it."""
    of_type, of_rc = _field(form, field), _field(limited, field)
    if of_rc is None or (of_type is not None and of_rc.most >= of_type.most):
        return None
    return max(0.0, of_rc.most)


def _field(form: CommandForm, name: str) -> FieldForm | None:
    return next((field for field in form.fields if field.name == name), None)
