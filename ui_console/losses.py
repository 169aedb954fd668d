"""Why a console has not, or no longer, what it wants: the scheduler's words as sentences for operators. Pure."""

from __future__ import annotations

WANTED = "self"
"""The word for what a console gave away of its own will."""

UNDECIDED = ("lost", "lease")
"""The words for a loss that nobody decided: the console was cut off, or paused."""

_SENTENCES = {
    "slice": "it is the turn of {by}",
    "higher": "{by} has the higher priority",
    "rc": "{by} does not answer",
    "capacity": "{by} can give less than before",
    "order": "{by} could not serve everybody in time",
    "failed": "it could not be made ready",
    WANTED: "no time was wanted",
    "silent": "this console gave no sign of life",
    "lease": "nothing was heard of the RC manager for too long",
    "lost": "what held it for this console has ended",
}
"""The words of ``Suspended.reason``."""


def why_lost(reason: str, by: str) -> str:
    """Return why something was taken from a console, or is kept from it, as part of a sentence.

    Args:
        reason: The scheduler's word, or any text.
        by: Because of whom, as people call them; empty: nobody.

    Example:
        >>> why_lost("slice", "ben"), why_lost("silent", ""), why_lost("a fuse blew", "")
        ('it is the turn of ben', 'this console gave no sign of life', 'a fuse blew')
    """
    sentence = _SENTENCES.get(reason)
    if sentence is not None:
        return sentence.format(by=by or "somebody else")
    return f"{reason}, because of {by}" if by else reason
