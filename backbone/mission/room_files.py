"""Files of a room that a mission file names: a room of one's own as MJCF, a drawn floor plan; read with the mission.

The mission contains their content, so that other machines need not have the files. Only the world can find out whether
MuJoCo can build the room; the checks here do not need MuJoCo.
"""

from __future__ import annotations

import base64
from pathlib import Path

from backbone.mission.document import Element, parse
from backbone.mission.report import Report, quoted
from backbone.mission.tables import FLOOR_PLAN

MAX_BYTES = 1024 * 1024  # chosen: as a mission file's; a room of ten thousand boxes fits
MAX_PLAN_BYTES = 384 * 1024  # chosen: in base64 512 KiB, a tenth of the longest value of a parameter
PICTURES = (b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff")
"""First bytes of PNG and JPEG files."""


class RoomInvalid(Exception):
    """A file of a room cannot be used: message and remedy."""


def room_text(mission_file: str, name: str) -> str:
    """Return the content of a room's file.

    Args:
        mission_file: The mission file that names it; a relative name is relative to its folder.
        name: The file's name as written there.

    Raises:
        RoomInvalid: The file cannot be read, is too large, is not MJCF, or needs further files.
    """
    data = _content(mission_file, name, "an MJCF file")
    if len(data) > MAX_BYTES:
        raise RoomInvalid(f"is larger than {MAX_BYTES} bytes", "Simplify the room")
    try:
        text = data.decode()
        if "<!DOCTYPE" in text:
            raise RoomInvalid("has a document type declaration", "Remove <!DOCTYPE …> from the room's file")
    except UnicodeDecodeError as error:
        raise RoomInvalid(f"is no UTF-8: {error}", "Save the room's file in UTF-8") from error
    report = Report(name)
    root = parse(data, report)
    if root is None:
        [fault] = report.faults()[:1]
        raise RoomInvalid(f"cannot be read: {fault.message} in line {fault.line}", "Mend the room's file")
    if root.tag != "mujoco":
        raise RoomInvalid(f"begins with <{root.tag}>, so it is no MJCF", "The room's file must begin with <mujoco>")
    for element in root:
        if element.tag == "include" or element.text("file"):
            raise RoomInvalid(
                f"needs the file {quoted(element.text('file'))} in line {element.place.line}",
                "Write what is in that file into the room's file; only this one travels with the mission",
            )
    return text


def floor_plan_text(mission_file: str, name: str) -> str:
    """Return the picture of a floor plan in base64.

    Args:
        mission_file: As for ``room_text``.
        name: As for ``room_text``.

    Raises:
        RoomInvalid: The file cannot be read, is too large, or is neither PNG nor JPEG.
    """
    data = _content(mission_file, name, "a picture")
    if len(data) > MAX_PLAN_BYTES:
        raise RoomInvalid(f"is larger than {MAX_PLAN_BYTES} bytes", "Scale the picture down, or save it as JPEG")
    if not data.startswith(PICTURES):
        raise RoomInvalid("is neither PNG nor JPEG", "Save the picture as one of them")
    return base64.b64encode(data).decode()


def _content(mission_file: str, name: str, what: str) -> bytes:
    """Return the first bytes of a file, at most one more than the largest size allows."""
    path = Path(mission_file).parent / name
    try:
        if path.exists() and not path.is_file():
            raise RoomInvalid("is no file", f"Name {what}")
        with path.open("rb") as file:
            return file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise RoomInvalid(f"cannot be read: {reason}", f"Name {what}, relative to the mission file") from error


def check_floor_plan(localizer: Element, report: Report) -> None:
    """Report the faults of the picture that a localizer names, if any."""
    for given in localizer.all("parameter"):
        name = given.text("value")
        if given.text("name") == FLOOR_PLAN and name:
            try:
                floor_plan_text(report.file, name)
            except RoomInvalid as invalid:
                message, remedy = invalid.args
                report.fault(given.place_of("value"), f"floor plan {quoted(name)} {message}", remedy)


def check_room_file(room: Element, report: Report) -> None:
    """Report the faults of the file that a room names, if any."""
    name = room.text("mjcf")
    if not name:
        return
    try:
        room_text(report.file, name)
    except RoomInvalid as invalid:
        message, remedy = invalid.args
        report.fault(room.place_of("mjcf"), f"room {quoted(name)} {message}", remedy)
