"""The commands that a class of RC declares, as forms; each needs a method that carries it out."""

from __future__ import annotations

from collections.abc import Mapping

from backbone.component.abilities import CommandForm, command_form
from backbone.wire import Accepts, UnknownMessage, kinds_of
from resource_pool.commands import OF_THE_BASE, Command

_METHODS = ("obey", "command")


def command_forms(rc: type, commands: Accepts | None, limits: Mapping[str, tuple[float, float]]) -> list[CommandForm]:
    """Return the form of each command that the RC's class declares.

    Args:
        rc: The class.
        commands: Its ``commands``.
        limits: Its ``limits``.

    Raises:
        UnknownMessage: No method of the class carries out one of them. A class that overrides ``obey`` or ``command``
            is trusted; a class to derive from states in ``obeyed`` what its own ``obey`` carries out. A command that a
            trusted class passes on to the base class is refused when it comes.
        TypeError: ``obeyed`` is no tuple of commands.
    """
    own = [kind for kind in (() if commands is None else kinds_of(commands)) if issubclass(kind, Command)]
    obeying = next(vars(one) for one in rc.__mro__ if any(method in vars(one) for method in _METHODS))
    obeyed = obeying.get("obeyed", own)
    if not isinstance(obeyed, tuple | list) or not all(_is_command(kind) for kind in obeyed):
        raise TypeError(f"obeyed of {rc.__name__} is {obeyed!r:.80}; write a tuple of command classes")
    lacking = [kind.__name__ for kind in own if kind not in obeyed]
    if lacking:
        remedy = f"Write it in {rc.__name__}, or remove them from commands."
        raise UnknownMessage(f"commands has {', '.join(lacking)}, and no obey carries it out", remedy=remedy)
    return [command_form(kind, kind.word(), moves=kind.moves, without=OF_THE_BASE, limits=limits) for kind in own]


def _is_command(kind: object) -> bool:
    return isinstance(kind, type) and issubclass(kind, Command)
