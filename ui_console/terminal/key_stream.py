"""Splits what a terminal sends into keys, reports and pasted text; what is none of these does nothing.

Rules of this file: no terminal and no clock. Characters of an unknown or cut sequence are no keys, with one exception:
a sequence that ends with an x or X, and is not known, was cut, and the letter is a key.

Textual's parser waits for the end of a paste for ever, and for that of other sequences for 32 characters. It takes the
characters of an answer, like ``xterm(370)``, for keys, which would stop a robot and take another one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from textual._xterm_parser import XTermParser
from textual.events import Key, Paste
from textual.message import Message

MOST_KEPT = 4096  # chosen: more than a line in a field, or an answer of a terminal
ESCAPE = "\x1b"
PASTE_BEGINS, PASTE_ENDS = "\x1b[200~", "\x1b[201~"  # xterm, "Bracketed Paste Mode"
CSI, SS3 = r"\x1b\[[<=>?]?[0-9:;-]*", r"\x1bO[0-9;]*"  # ECMA-48, 5.4 and 8.3.143
STRING = r"\x1b[\]P_^][^\x07\x1b]"  # ECMA-48, 5.6: OSC, DCS, APC, PM; SOS has the bytes of alt+shift+x
MOUSE = r"\x1b\[M[^\x1b]"  # xterm, "Normal tracking mode": three characters
MODE = r"\x1b\[\?[0-9;]*\$"  # DEC VT510, DECRPM; without the question mark, rxvt's keys end with the $
CUT = re.compile(rf"\x1b|\x1b[\]P_^]\x1b?|{STRING}+\x1b?|{CSI}[ -#%-/]*|{MODE}|{MOUSE}{{0,2}}|\x1b\[\[|{SS3}")
TOKEN = re.compile(
    rf"({MOUSE}{{3}}|\x1b\[\[[A-E]|{MODE}[@-~]|{CSI}(?:\$|[ -#%-/]*[@-~])|{SS3}[ -~]|{STRING}+(?:\x07|\x1b\\)?"
    rf"|{CSI}[ -/]*|{SS3}|\x1b[^\x1b]|.)",
    re.DOTALL,
)
STOP = re.compile(r"([xX]|\x1b\[120[:;][0-9:;]*u)\1*")  # as text, and in the protocol of kitty
ONE_KEY = re.compile(rf"([^\x1b]|{CSI}[@-~]|\x1bO.|\x1b.)\1*", re.DOTALL)


class KeyStream(XTermParser):
    """Input of one terminal.

    Law: a read of x or X alone is a key, whatever came before. So is a read of any other key alone after a pause.
    """

    def __init__(self) -> None:
        super().__init__()
        self._left = self._pasted = ""
        self._is_pasting = self._is_quiet = False

    def typed(self, text: str) -> Iterator[Message]:
        """Yield what the characters mean that one read returned, in order."""
        is_key = STOP.fullmatch(text) or (self._is_quiet and text != PASTE_ENDS and ONE_KEY.fullmatch(text))
        if is_key and self._is_pasting:
            yield from self._end_paste(self._left)
        elif is_key and self._left != ESCAPE:
            self._left = ""
        self._is_quiet = False
        self._left += text
        while self._left:
            if self._is_pasting:
                before, ends, after = self._left.partition(PASTE_ENDS)
                if not ends:
                    self._keep_pasted()
                    return
                yield from self._end_paste(before, after)
            elif CUT.fullmatch(self._left):
                self._left = self._left[:MOST_KEPT]
                return
            else:
                _, token, self._left = TOKEN.split(self._left, maxsplit=1)
                yield from self._meaning(token)

    def pause(self) -> Iterable[Message]:
        """Return what the characters mean after which no others came for a while; the rest of a sequence is dropped."""
        self._is_quiet = True
        if self._is_pasting:
            return ()
        left, self._left = self._left, ""
        return [Key("escape", ESCAPE)] if left == ESCAPE else ()

    def _end_paste(self, last: str, after: str = "") -> Iterator[Message]:
        text = (self._pasted + last)[:MOST_KEPT].replace("\0", "")
        self._left, self._pasted, self._is_pasting = after, "", False
        if text:
            yield Paste(text)

    def _keep_pasted(self) -> None:
        at = max(0, len(self._left) - len(PASTE_ENDS) + 1)
        self._pasted = (self._pasted + self._left[:at])[:MOST_KEPT]
        self._left = self._left[at:]

    def _meaning(self, token: str) -> Iterable[Message]:
        if token == PASTE_BEGINS:
            self._is_pasting = True
        elif token == ESCAPE:
            return [Key("escape", ESCAPE)]
        elif token[0] != ESCAPE or token[1] in "[O":
            return self._known(token)
        elif len(token) == 2:
            return [*self._sequence_to_key_events(token)] or [*self._sequence_to_key_events(token[1], alt=True)]
        return ()

    def _known(self, token: str) -> Iterable[Message]:
        try:
            meant = [*self.feed(token)]
        except (ValueError, OverflowError):  # a number that no key has
            meant, is_known = [], False
        else:
            is_known = self._awaiting.timeout is None
        if is_known:
            return meant
        self._gen = self.parse(self._tokens.append)
        self._awaiting = next(self._gen)
        self._timeout_time = None
        return self._known(token[-1]) if token.startswith(f"{ESCAPE}[") and token[-1] in "xX" else ()
