"""Draws ``air.jpg``, what each effect of the air does to one picture: ``.venv/bin/python docs/pictures/air.py``.

The scene is that of ``mission.xml``, seen by its second Scout while the Pioneer passes, in a second.
"""

from __future__ import annotations

from pathlib import Path

import msgspec

from scout_model.gl_probe import prepare, probe

SUPPORT = probe()
prepare(SUPPORT.backend)

import cv2  # noqa: E402  mujoco must not be imported before the process is prepared for OpenGL
import numpy as np  # noqa: E402

from backbone.mission.reader import read_mission  # noqa: E402
from scout_model.camera import Camera  # noqa: E402
from scout_model.description import AS_THE_PAPERS, CLEAN_AIR, AirDescription, WorldDescription  # noqa: E402
from scout_model.video_link import FrameKind, Picture, Receiver, Signal  # noqa: E402
from scout_model.world import World  # noqa: E402

HERE = Path(__file__).parent
MISSION_XML = HERE.parents[1] / "mission.xml"
WATCHING, OTHER = "scout2", "scout3"
PASSES_FRAME = 575  # of the Pioneer in the middle of the second Scout's view
COLUMNS, SCALE, QUALITY = 4, 0.75, 82
SEED = 1
ALIKE = 0.7  # a partial frame of a still scene that was filled up with an older picture shows nothing


def only(**scales: float) -> AirDescription:
    """Return air that has these effects alone."""
    none = {"white_noise": 0.0, "tears": 0.0, "ghosts": 0.0, "fades": 0.0, "partial_frames": 0.0, "noise": 1.0}
    return msgspec.structs.replace(CLEAN_AIR, **{**none, **scales})


def first(kind: FrameKind, air: AirDescription, *signals: Signal, frames: int = 2000) -> Picture:
    """Return the first frame of this kind.

    Raises:
        LookupError: There is none among so many.
    """
    receiver = Receiver(SEED, "video1", air)
    for frame in range(frames):
        reception = receiver.receive(signals, frame)
        alike = len(signals) == 1 and np.mean(reception.picture == signals[0].picture) > ALIKE
        if reception.kind is kind and not (kind is FrameKind.PARTIAL and alike):
            return reception.picture
    raise LookupError(f"no {kind} frame")


def views() -> tuple[Picture, Picture]:
    """Return what the watching and another Scout see while the target passes."""
    [component] = read_mission(MISSION_XML).components
    world = World(msgspec.convert(component.parameters["world"], WorldDescription))
    for _ in range(PASSES_FRAME):
        world.step_frame()
    with Camera(world.mjcf, SUPPORT.camera_backend) as camera:
        camera.show(world.state())
        return camera.picture(WATCHING), camera.picture(OTHER)


def panels() -> dict[str, Picture]:
    """Return pictures by what they show."""
    seen, other = views()
    sent, driven = Signal(seen, WATCHING), Signal(seen, WATCHING, motors=1.0)
    settling = msgspec.structs.replace(CLEAN_AIR, settling=1.0)
    weak = only(white_noise=1.0, weak_signal=1.0)
    return {
        "as sent": seen,
        "white noise, 4 m": first(FrameKind.CLEAN, only(white_noise=1.0), sent),
        "weak signal, 40 m": first(FrameKind.CLEAN, weak, Signal(seen, WATCHING, 40.0)),
        "tears, motors running": first(FrameKind.TORN, only(tears=1.0), driven),
        "ghost (scale 4)": first(FrameKind.GHOST, only(ghosts=4.0), sent),
        "fade": first(FrameKind.FADED, only(fades=1.0), sent),
        "partial frame": first(FrameKind.PARTIAL, only(partial_frames=1.0), sent),
        "settling": first(FrameKind.SETTLING, settling, sent),
        "papers, clean": first(FrameKind.CLEAN, AS_THE_PAPERS, sent),
        "papers, in a fade": first(FrameKind.FADED, AS_THE_PAPERS, sent),
        "two on one frequency": first(FrameKind.GARBAGE, AS_THE_PAPERS, sent, Signal(other, OTHER)),
        "nobody": first(FrameKind.SNOW, AS_THE_PAPERS),
    }


def labelled(picture: Picture, label: str) -> Picture:
    """Return the picture, smaller, with its label below."""
    small = cv2.resize(picture, None, fx=SCALE, fy=SCALE, interpolation=cv2.INTER_AREA)
    framed = np.full((small.shape[0] + 24, small.shape[1] + 6), 255, np.uint8)
    framed[3 : 3 + small.shape[0], 3:-3] = small
    cv2.putText(framed, label, (4, framed.shape[0] - 7), cv2.FONT_HERSHEY_SIMPLEX, 0.42, 0, 1, cv2.LINE_AA)
    return framed


def main() -> None:
    """Write ``air.jpg`` beside this file."""
    drawn = [labelled(picture, label) for label, picture in panels().items()]
    rows = [np.hstack(drawn[begin : begin + COLUMNS]) for begin in range(0, len(drawn), COLUMNS)]
    cv2.imwrite(str(HERE / "air.jpg"), np.vstack(rows), [cv2.IMWRITE_JPEG_QUALITY, QUALITY])


if __name__ == "__main__":
    main()
