"""Refusal of words that are no command: one form and one place for all faults in arguments and options."""

from __future__ import annotations

import re
from typing import cast

import typer

from backbone.errors import Refusal

WRONG_WORDS = cast("type[Exception]", typer.BadParameter.__base__)  # Typer does not export the base of its complaints
_OWN_WORDS = (
    (r"Invalid value for (?:argument )?'?(?P<name>[^':]+)'?: (?P<why>.*)", r"\g<name>: \g<why>"),
    (r"Invalid value: (?P<why>.*)", r"\g<why>"),
    (r"Missing (?:argument|option) '?(?P<name>[^']+?)'?\.", r"\g<name> is missing"),
    (
        r"No such (?P<what>option|command):? '?(?P<name>[^' ]+?)'?\.? "
        r"(?:\(Possible options: (?P<options>.*)\)|Did you mean (?P<near>.*)\?)",
        r"there is no \g<what> \g<name> (did you mean \g<options>\g<near>?)",
    ),
    (r"No such (?P<what>option|command):? '?(?P<name>[^' ]+?)'?\.?", r"there is no \g<what> \g<name>"),
    (r"Got unexpected extra arguments?(?:\(s\))? \((?P<words>.*)\)", r"too many arguments: \g<words>"),
    (r"Option '(?P<name>[^']+)' requires .*", r"\g<name> needs a value"),
)
_NO_NUMBER = re.compile(r"is not a valid (?P<kind>int|float)(?:eger)?(?: range)?$")
_RANGE = re.compile(r"(?P<given>\S+) is not in the range (?P<range>\S+)$")


class WrongUsage(Refusal):
    """The words of the command line name no command, option or value that exists."""

    code = "usage.words"
    remedy = "See --help."


def refusal_of(complaint: Exception) -> WrongUsage:
    """Return Typer's complaint as a refusal, in the words of the project.

    Args:
        complaint: Of the class ``WRONG_WORDS``.
    """
    command = getattr(getattr(complaint, "ctx", None), "command_path", "")
    remedy = f"See '{command} --help'." if command else WrongUsage.remedy
    return WrongUsage(own_words(getattr(complaint, "format_message", str)()), remedy=remedy)


def is_request_for_help(complaint: Exception) -> bool:
    """Return whether a table was named without a command; then Typer prints its help."""
    return type(complaint).__name__ == "NoArgsIsHelpError"  # Typer does not export the class


def own_words(complaint: str) -> str:
    """Return a complaint of Typer in the words of the project; a complaint of another form stays as it is.

    Example:
        >>> own_words("Invalid value for '--most': 0 is not in the range 1<=x<=9.")
        '--most: 0 is not between 1 and 9'
        >>> own_words("Missing argument 'FILE.mcap'.")
        'FILE.mcap is missing'
    """
    said = complaint
    for form, words in _OWN_WORDS:
        if (found := re.fullmatch(form, complaint, re.DOTALL)) is not None:
            said = found.expand(words)
            break
    said = said.removesuffix(".")
    said = _NO_NUMBER.sub(lambda found: f"is no {'whole ' if found['kind'] == 'int' else ''}number", said)
    return _RANGE.sub(lambda found: f"{found['given']} is not {_range_in_words(found['range'])}", said)


def _range_in_words(limits: str) -> str:
    """Return limits such as ``1<=x<=9`` or ``x>=1`` in words."""
    if (both := re.fullmatch(r"(.+?)<=x<=(.+)", limits)) is not None:
        return f"between {both[1]} and {both[2]}"
    if (one := re.fullmatch(r"x([<>])=(.+)", limits)) is not None:
        return f"at {'least' if one[1] == '>' else 'most'} {one[2]}"
    return f"in the range {limits}"
