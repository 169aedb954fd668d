"""Real pixels in capable terminals: the kitty graphics protocol with Unicode placeholders (kitty, Ghostty).

The picture is sent once as PNG under an image number; its cells contain placeholder characters whose color encodes that
number. A new picture replaces the old one under the same number, so no cell changes and nothing flickers. Terminals
without this protocol get half blocks. So do terminals inside a multiplexer, because it would drop the picture.

Source: kitty, "Terminal graphics protocol", sections "The transmission medium" and "Unicode placeholders".
"""

from __future__ import annotations

import base64
import struct
import zlib
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from rich.color import Color
from rich.segment import ControlType, Segment
from rich.style import Style

IMAGE = 42  # chosen: a color can encode any number of 24 bits
PLACEHOLDER = "\U0010eeee"
CHUNK_BYTES = 4096  # the protocol's maximum
GREY, TRUE_COLOR = 0, 2  # PNG, "Color type"
PNG_LEVEL = 1  # chosen: analog noise does not compress anyway
ROW_MARKS = (
    "\u0305\u030d\u030e\u0310\u0312\u033d\u033e\u033f\u0346\u034a\u034b\u034c\u0350\u0351\u0352\u0357"
    "\u035b\u0363\u0364\u0365\u0366\u0367\u0368\u0369\u036a\u036b\u036c\u036d\u036e\u036f\u0483\u0484"
    "\u0485\u0486\u0487\u0592\u0593\u0594\u0595\u0597\u0598\u0599\u059c\u059d\u059e\u059f\u05a0\u05a1"
    "\u05a8\u05a9\u05ab\u05ac\u05af\u05c4\u0610\u0611\u0612\u0613\u0614\u0615\u0616\u0617\u0657\u0658"
)
"""The combining characters that stand for 0, 1, 2 … behind a placeholder, in the protocol's order."""
MOST_ROWS = len(ROW_MARKS)


def can_show_pixels(environment: Mapping[str, str]) -> bool:
    """Return whether the terminal of this environment shows pictures by this protocol.

    Example:
        >>> can_show_pixels({"TERM": "xterm-kitty"}), can_show_pixels({"TERM": "xterm-256color"})
        (True, False)
    """
    if environment.get("TMUX") or environment.get("STY") or "NO_COLOR" in environment:  # a color names the picture
        return False
    return (
        environment.get("TERM") in ("xterm-kitty", "xterm-ghostty")
        or environment.get("TERM_PROGRAM") == "ghostty"
        or "KITTY_WINDOW_ID" in environment
    )


def send(picture: NDArray[np.uint8], columns: int, rows: int) -> Segment:
    """Return the escape sequence that shows this picture at the placeholders.

    Args:
        picture: As for ``png``.
        columns: Cells across.
        rows: Cells down, at most ``MOST_ROWS``.
    """
    payload = base64.standard_b64encode(png(picture)).decode()
    chunks = [payload[at : at + CHUNK_BYTES] for at in range(0, len(payload), CHUNK_BYTES)]
    head = f"a=T,U=1,i={IMAGE},f=100,c={columns},r={rows},q=2"
    parts = []
    for number, chunk in enumerate(chunks):
        more = int(number < len(chunks) - 1)
        parts.append(f"\x1b_G{head},m={more};{chunk}\x1b\\" if number == 0 else f"\x1b_Gm={more},q=2;{chunk}\x1b\\")
    return Segment("".join(parts), None, [(ControlType.CURSOR_FORWARD, 0)])


def row_of_cells(row: int, columns: int) -> Segment:
    """Return one row of placeholders; the first names the row, the others follow from it."""
    return Segment(PLACEHOLDER + ROW_MARKS[row] + PLACEHOLDER * (columns - 1), _STYLE)


def png(picture: NDArray[np.uint8]) -> bytes:
    """Return the picture as PNG, 8 bits of grey, or of red, green and blue each.

    Args:
        picture: Grey levels 0 to 255 of shape (height, width), or red, green and blue of shape (height, width, 3), row
            0 on top.
    """
    height, width = picture.shape[:2]
    channels = 1 if picture.ndim == 2 else 3
    filtered = np.zeros((height, channels * width + 1), np.uint8)  # every row begins with its filter: 0, none
    filtered[:, 1:] = picture.reshape(height, channels * width)
    header = struct.pack("!IIBBBBB", width, height, 8, GREY if channels == 1 else TRUE_COLOR, 0, 0, 0)
    body = zlib.compress(filtered.tobytes(), PNG_LEVEL)
    return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header) + _chunk(b"IDAT", body) + _chunk(b"IEND", b"")


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack("!I", len(body)) + kind + body + struct.pack("!I", zlib.crc32(kind + body))


_STYLE = Style(color=Color.from_rgb(0, 0, IMAGE))  # Textual draws colors of the palette as others, which name no image
