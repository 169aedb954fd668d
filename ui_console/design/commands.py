"""Commands that change a designed mission, as values, and their refusals. Pure; ``effects`` defines the commands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Concatenate, ParamSpec

from backbone.errors import Refusal
from backbone.mission.edit import Path

P = ParamSpec("P")


class DesignRefused(Refusal):
    """A command is not possible; the draft is unchanged."""

    code = "design.refused"
    remedy = "Choose something else."


class ElementNameTaken(DesignRefused):
    """Two elements of a kind would have one name, so a reference to it would mean both."""

    code = "design.name_taken"
    remedy = "Give it a name that no other element has."


class NothingToUndo(DesignRefused):
    """There is no step in this direction."""

    code = "design.no_step"
    remedy = "Nothing was done, or all of it is undone."


@dataclass(frozen=True, slots=True)
class TextState:
    """One state of the text.

    Attributes:
        text: The bytes of the file.
        touched: The element added or changed last; the cursor goes there.
    """

    text: bytes
    touched: Path = ()


@dataclass(frozen=True)
class DesignCommand:
    """A change that can be applied to any text.

    Attributes:
        effect: Returns the new text; its first argument is the old text.
        arguments: Its other arguments.
        named: Keyword arguments.
    """

    effect: Callable[..., TextState]
    arguments: tuple[Any, ...]
    named: dict[str, Any]

    def carry_out(self, text: bytes) -> TextState:
        """Return the text after the command, and the element that it touched.

        Raises:
            Refusal: ``DesignRefused``, ``EditRefused`` or ``IllegalName``: the command is not possible.
        """
        return self.effect(text, *self.arguments, **self.named)


def command(effect: Callable[Concatenate[bytes, P], TextState]) -> Callable[P, DesignCommand]:
    """Return a function that creates a command from an effect's arguments (all but the text)."""

    def made(*arguments: P.args, **named: P.kwargs) -> DesignCommand:
        return DesignCommand(effect, arguments, named)

    return made
