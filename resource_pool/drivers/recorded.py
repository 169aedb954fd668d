"""Driver that plays the pictures of a file as those of a framegrabber: of a video, or of a camera in a recording.

It plays from the moment of opening, in mission time: at each time it shows the newest picture that is not later in the
file. It goes on while no ARC holds the framegrabber, as a camera does. It knows no frequencies: it shows the same on
each of them. The pictures are decoded in a thread of their own; on a virtual clock in the event loop, in no virtual
time, so a mission with the file is the same each time.
"""

from __future__ import annotations

import asyncio
import importlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated, Protocol, TypeVar

import msgspec

from backbone.waiting import bug_of, end_tasks
from resource_pool.drivers.interface import DriverSite, FixedOption, HardwareFault, Picture
from resource_pool.drivers.picture_pace import PicturePace
from resource_pool.drivers.picture_turns import PictureTurns

RECORDING = ".mcap"
T = TypeVar("T")


class RecordedOptions(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Options of a camera that is played from a file.

    Attributes:
        file: A video that OpenCV can play, or a recording (``.mcap``), on the host of the framegrabber. A relative name
            begins at the folder in which ``up`` or ``creator`` was started there.
        key: Key of the pictures in a recording, as in ``resource_pool/watch-capture/frames``; ``*`` stands for any
            text; empty: it has only one camera.
        loop: True: after its end the file begins again.
    """

    file: Annotated[str, msgspec.Meta(min_length=1)]
    key: str = ""
    loop: bool = False


class Film(Protocol):
    """An open file with pictures, for one thread at a time.

    Attributes:
        hz: Pictures a second, on average.
    """

    hz: float

    def advance(self) -> float | None:
        """Take the next picture; return its time in seconds since the first one. None: there is no further one."""

    def picture(self, captured_s: float) -> Picture | None:
        """Return the taken picture, with this time; None: it is damaged."""

    def rewind(self) -> None:
        """Begin again."""

    def close(self) -> None:
        """Close the file."""


class RecordedCamera:
    """A camera whose pictures are in a file."""

    opens_beside = True
    options_type = RecordedOptions

    def __init__(self, site: DriverSite) -> None:
        self._site = site
        self._options = site.options(RecordedOptions)
        self._pace = PicturePace(site.parameters.frame_rate_hz)
        self._turns = PictureTurns()
        self._deliver: Callable[[Picture], None] | None = None
        self._tuned_s = 0.0
        self._film: Film | None = None
        self._thread = _new_thread()
        self._playing: asyncio.Task[None] | None = None

    def adjust(self, site: DriverSite) -> None:
        """Apply the new rate from the next picture on."""
        if site.options(RecordedOptions) != self._options:
            raise FixedOption(f"{site.resource} cannot change what it plays while it runs")
        self._pace.ask(site.parameters.frame_rate_hz)
        self._turns.begin()
        if self._playing is not None and not self._playing.done():
            self._remark_rate()

    def allowed_hz(self) -> float:
        """Return the rate of the file or of a busy host, if lower than the requested one; see ``YieldingDriver``."""
        return self._pace.allowed_hz if self._film is None else min(self._pace.allowed_hz, self._film.hz)

    async def open(self) -> None:
        """Open the file, and begin to play."""
        self._film = await self._in_thread(self._opened)
        self._remark_rate()
        playing = self._play(self._film, self._site.clock.now_s())
        self._playing = asyncio.create_task(playing, name=f"{self._site.resource}: play")
        self._playing.add_done_callback(self._played)

    def tune(self, frequency: str, deliver: Callable[[Picture], None]) -> None:  # noqa: ARG002  it plays on each
        """Deliver the pictures from the next one on; see ``FramegrabberDriver.tune``."""
        self._turns.begin()
        self._deliver, self._tuned_s = deliver, self._site.clock.now_s()

    def stop(self) -> None:
        """Stop the delivery of pictures; the file plays on."""
        self._deliver = None

    async def close(self) -> None:
        """Close the file."""
        self.stop()
        if self._playing is not None:
            await end_tasks(self._playing)
        film, self._film = self._film, None
        if film is not None:
            await self._in_thread(film.close)
        self._thread.shutdown(wait=False)
        self._thread = _new_thread()  # if it is opened again

    def _opened(self) -> Film:
        """Open the file. When: in the thread, because the import of a library takes a while."""
        name = self._options.file
        if not Path(name).is_file():
            raise HardwareFault(
                f"there is no file {Path(name).absolute()}", remedy="Write its whole path in option 'file'."
            )
        if name.endswith(RECORDING):
            recording: Film = importlib.import_module("resource_pool.drivers.recording_film").RecordingFilm(
                name, self._options.key
            )
            return recording
        video: Film = importlib.import_module("resource_pool.drivers.opencv_pictures").VideoFilm(name)
        return video

    async def _play(self, film: Film, begin_s: float) -> None:
        while True:
            begin_s = await self._play_once(film, begin_s) + 1.0 / film.hz
            if not self._options.loop:
                self._site.remark(f"{self._options.file} has ended, and is not repeated")
                return
            await self._in_thread(film.rewind)

    async def _play_once(self, film: Film, begin_s: float) -> float:
        """Play the file from this time on; return the time of its last picture."""
        last_s = None
        while (at_s := await self._in_thread(film.advance)) is not None:
            last_s = begin_s + at_s
            await self._site.clock.sleep_until_s(last_s)
            await self._show(film, last_s)
        if last_s is None:
            raise HardwareFault(f"{self._options.file} has no pictures", remedy="Name another file in option 'file'.")
        return last_s

    async def _show(self, film: Film, captured_s: float) -> None:
        """Deliver the picture, unless the next one is due too, because the event loop was late."""
        deliver, clock = self._deliver, self._site.clock
        is_old = clock.now_s() >= captured_s + 1.0 / film.hz
        allowed_hz = self._pace.allowed_hz
        if deliver is None or captured_s < self._tuned_s or is_old or not self._turns.take(captured_s, allowed_hz):
            return
        if self._pace.delivered((clock.now_s() - captured_s) / clock.rate, clock.now_s() / clock.rate):
            self._remark_rate()
        picture = await self._in_thread(lambda: film.picture(captured_s))
        if picture is not None and self._deliver is deliver:
            deliver(picture)

    def _played(self, playing: asyncio.Task[None]) -> None:
        if (bug := bug_of(playing)) is not None:
            self._site.fail(bug)

    def _remark_rate(self) -> None:
        """Show the rate of a busy host, or else of the file, if it is lower than the requested one."""
        allowed_hz, asked_hz = self.allowed_hz(), self._pace.asked_hz
        few = f"{allowed_hz:.3g} of {asked_hz:.3g} pictures a second: {self._options.file} has no more"
        self._site.remark(self._pace.remark() or (few if allowed_hz < asked_hz else ""))

    async def _in_thread(self, work: Callable[[], T]) -> T:
        return await asyncio.get_running_loop().run_in_executor(self._thread, work)


def _new_thread() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(1, thread_name_prefix="film")
