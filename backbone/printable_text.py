r"""Makes text of any origin printable: it cannot control a terminal, a browser or a log.

Rules of this file: pure, and quick to load, because every command prints through it. Characters that
``str.isprintable`` refuses become visible escapes: control characters (ESC, CR, the 8-bit CSI), format characters
(bidirectional overrides), lone surrogates, line separators. A text that is too long is cut and ends with the number of
missing characters.
"""

from __future__ import annotations

MOST_CHARACTERS = 2000  # chosen: several times a component's longest feedback
MOST_LINES = 200  # chosen: more lines than a refusal quotes from a log


def printable(text: str, most: int = MOST_CHARACTERS) -> str:
    r"""Return the text as one printable line of bounded length.

    Example:
        >>> printable("\x1b[2Jall is well\r")
        '\\x1b[2Jall is well\\r'
        >>> printable("aaaa", most=3)
        'aaa… (1 more)'
    """
    if len(text) <= most and text.isprintable():
        return text
    shown = "".join(each if each.isprintable() else _escape(each) for each in text[:most])
    return shown if len(text) <= most else f"{shown}… ({len(text) - most} more)"


def printable_lines(text: str, most: int = MOST_CHARACTERS) -> str:
    r"""Return the text with its lines kept, each of them printable.

    Example:
        >>> printable_lines("one\ntwo\tthree")
        'one\ntwo    three'
    """
    if text.isprintable() and len(text) <= most:
        return text
    lines = text.split("\n")
    shown = [printable(line.replace("\t", "    "), most) for line in lines[:MOST_LINES]]
    return "\n".join([*shown, f"… ({len(lines) - MOST_LINES} lines more)"] if len(lines) > MOST_LINES else shown)


def _escape(character: str) -> str:
    return character.encode("unicode_escape", "backslashreplace").decode("ascii")
