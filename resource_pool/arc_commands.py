"""The commands of one type of ARC: which RC of its set obeys which. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from backbone.component.abilities import CommandForm, command_form
from resource_pool.commands import OF_THE_BASE, Command, command_of
from resource_pool.messages import GiveCommand, NoSuchAction


class ArcCommands:
    """What the owner of such an ARC may command.

    Args:
        kind: The type of the ARC.
        able: Command → the role of the RC that obeys it; several roles: the command names one.
    """

    def __init__(self, kind: str, able: Mapping[type[Command], str | Sequence[str]]) -> None:
        self._kind, self._able = kind, able

    def forms(self) -> list[CommandForm]:
        """Return each command as consoles offer it."""
        return [
            command_form(kind, kind.word(), moves=kind.moves, without=OF_THE_BASE, roles=self._roles_of(kind))
            for kind in self._able
        ]

    def by_word(self, order: GiveCommand) -> Command:
        """Return the command that has this word.

        Raises:
            NoSuchAction: None has it. ``Refusal``: its values are not legal.
        """
        for kind in self._able:
            if kind.word() == order.word:
                return command_of(kind, order.values, role=order.role, after_stop=order.after_stop)
        known = ", ".join(kind.word() for kind in self._able)
        raise NoSuchAction(f"{self._kind} has no command {order.word}; it has: {known}", command=order.word)

    def role_of(self, command: Command) -> str:
        """Return the role of the RC that is to obey.

        Raises:
            NoSuchAction: The RC of this role does not obey such a command, or several do and the command names none.
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
