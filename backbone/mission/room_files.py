"""A room of the user's own that a mission file names: MJCF, read when the mission is.

The mission carries the room's text, so that the machine that plays the world need not have the file.
Whether MuJoCo can build it is found out by the world; here is looked at what needs no MuJoCo.
"""

from __future__ import annotations

from pathlib import Path

from backbone.mission.document import Element, parse
from backbone.mission.report import Report, quoted

MAX_BYTES = 1024 * 1024  # chosen: as a mission file's; a room of ten thousand boxes fits


class RoomInvalid(Exception):
    """A room's file cannot be used: what is wrong, and the remedy."""


def room_text(mission_file: str, name: str) -> str:
    """Return what a room's file holds.

    Args:
        mission_file: The mission file that names it; a relative name is relative to its folder.
        name: The file's name as it stands there.

    Raises:
        RoomInvalid: The file cannot be read, is too large, no MJCF, or needs further files.
    """
    path = Path(mission_file).parent / name
    try:
        if path.exists() and not path.is_file():
            raise RoomInvalid("is no file", "Name an MJCF file")
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise RoomInvalid(f"cannot be read: {reason}", "Name an MJCF file, relative to the mission file") from error
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


def check_room_file(room: Element, report: Report) -> None:
    """Report what is wrong with the file a room names, if it names one."""
    name = room.text("mjcf")
    if not name:
        return
    try:
        room_text(report.file, name)
    except RoomInvalid as invalid:
        message, remedy = invalid.args
        report.fault(room.place_of("mjcf"), f"room {quoted(name)} {message}", remedy)
