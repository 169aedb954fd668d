"""The pictures of a camera in a recording of a mission. The driver that plays them imports this file when it opens."""

from __future__ import annotations

import base64
from pathlib import Path

from backbone.errors import Refusal
from backbone.recording.hearing import is_meant
from backbone.recording.reader import Recorded, Recording, open_file
from resource_pool.drivers.interface import HardwareFault, Picture

FRAMES = "Frame/"
PARTS = {"captured_s", "pixels", "width_px", "height_px"}
"""Fields that a picture has; a module's own message may have its name."""


class RecordingFilm:
    """The pictures of one key of a recording; see ``recorded.Film``.

    Args:
        key: Key of the pictures; ``*`` stands for any text; empty: there is only one.

    Raises:
        HardwareFault: The file is no recording, or has no such pictures, or has several cameras and the key is empty.
    """

    def __init__(self, path: str, key: str) -> None:
        self._path = path
        try:
            self._file = open_file(Path(path))
        except OSError as error:
            raise HardwareFault(f"{path} cannot be read: {error.strerror}", remedy="Let this user read it.") from error
        try:
            self._recording = Recording(self._file)
            self._keys, self.hz = self._chosen(key)
        except Refusal as refusal:
            self._file.close()
            raise HardwareFault(refusal.detail, remedy=refusal.remedy) from refusal
        self._messages = self._recording.messages(self._keys)
        self._taken: Recorded | None = None
        self._first_s = 0.0

    def advance(self) -> float | None:
        """Take the next picture that is newer than the last one; see ``recorded.Film``."""
        for message in self._messages:
            body = message.body
            if message.schema.startswith(FRAMES) and isinstance(body, dict) and body.keys() >= PARTS:
                at_s = float(body["captured_s"])
                if self._taken is None:
                    self._first_s = at_s
                elif at_s <= self._taken.body["captured_s"]:
                    continue
                self._taken = message
                return at_s - self._first_s
        return None

    def picture(self, captured_s: float) -> Picture | None:
        """Return the taken picture."""
        if self._taken is None:
            return None
        body = self._taken.body
        pixels = memoryview(base64.b64decode(body["pixels"]))
        return Picture(captured_s, pixels, body["width_px"], body["height_px"])

    def rewind(self) -> None:
        """Begin again."""
        self._messages, self._taken = self._recording.messages(self._keys), None

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _chosen(self, key: str) -> tuple[tuple[str, ...], float]:
        """Return the keys of the pictures, and how many a second the recording has on average."""
        contents = self._recording.contents()
        of = {one.key for one in contents.counts if one.schema.startswith(FRAMES) and one.messages}
        keys = tuple(one for one in of if not key or is_meant(one, (key,)))
        if not keys or (len(keys) > 1 and not key):
            there = ", ".join(sorted(one.split("/", 2)[-1] for one in of)) or "none"
            missing = f"no pictures of key {key}" if key else "several cameras" if keys else "no pictures"
            raise HardwareFault(f"{self._path} has {missing}", remedy=f"Name one in option 'key'; there is: {there}.")
        pictures = sum(one.messages for one in contents.counts if one.key in keys)
        return keys, pictures / max(contents.end_s - contents.begin_s, 1.0)
