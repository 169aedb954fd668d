"""The commands of one type of ARC, and the RC of its set that carries out each command. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from backbone.component.abilities import CommandForm, command_form
from backbone.errors import Refusal
from resource_pool.commands import OF_THE_BASE, Command, command_of
from resource_pool.messages import GiveCommand, NoSuchAction


class WrongRoles(Refusal):
    """The class of an ARC declares roles that do not fit each other."""

    code = "arc.roles"
    remedy = "Mend roles, commands or body of the class."


class ArcCommands:
    """The commands that an ARC of one type accepts from its owner.

    Args:
        kind: The type of the ARC.
        able: Command → role of the RC that carries it out. If there are several roles, the command names one.
        roles: All roles of its set.
        body: Role of the RC that has a body; empty: none.

    Raises:
        WrongRoles: The roles are one text, the commands have none, or a role of the others is not among them.
    """

    def __init__(
        self,
        kind: str,
        able: Mapping[type[Command], str | Sequence[str]],
        roles: Mapping[str, str] | Sequence[str],
        body: str,
    ) -> None:
        self._kind, self._able = kind, able
        if isinstance(roles, str):
            raise WrongRoles(f"{kind}: roles is a text; write a tuple, with a comma: ({roles!r},)")
        if not isinstance(able, Mapping):
            raise WrongRoles(f"{kind}: commands has no roles; write a mapping: {{Command: 'role'}}")
        named = [("body", body), *((one.__name__, role) for one in able for role in self._roles_of(one))]
        for what, role in named:
            if role and role not in roles:
                raise WrongRoles(f"{kind}: {what} names the role {role!r}; its roles are: {', '.join(roles) or 'none'}")

    def forms(self) -> list[CommandForm]:
        """Return each command in the form that consoles show."""
        return [
            command_form(kind, kind.word(), moves=kind.moves, without=OF_THE_BASE, roles=self._roles_of(kind))
            for kind in self._able
        ]

    def by_word(self, order: GiveCommand) -> Command:
        """Return the command that has this word.

        Raises:
            NoSuchAction: No command has this word.
            WrongCommand: The values do not fit the command's fields.
        """
        for kind in self._able:
            if kind.word() == order.word:
                return command_of(kind, order.values, role=order.role, after_stop=order.after_stop)
        known = ", ".join(kind.word() for kind in self._able)
        raise NoSuchAction(f"{self._kind} has no command {order.word}; it has: {known}", command=order.word)

    def role_of(self, command: Command) -> str:
        """Return the role of the RC that carries out the command.

        Raises:
            NoSuchAction: The RC of this role does not accept this command, or several RCs accept it and the command
                names no role.
        """
        roles = self._roles_of(type(command))
        if command.role not in ([*roles, ""] if len(roles) == 1 else roles):
            which = f"no {command.role} that obeys" if command.role else "several RCs that obey"
            raise NoSuchAction(
                f"{self._kind} has {which} {command.word()}",
                remedy=f"Name one of these roles in the command: {', '.join(roles)}.",
                role=command.role,
            )
        return command.role or roles[0]

    def _roles_of(self, command: type[Command]) -> list[str]:
        able = self._able[command]
        return [able] if isinstance(able, str) else list(able)
