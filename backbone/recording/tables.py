"""Tables: the messages of a key as rows with a column for each field. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from backbone.keys import Conversation, address_of
from backbone.naming import component_of
from backbone.recording.reader import Recorded

FIRST_COLUMNS = ("at_s", "source", "sequence", "cause", "commanded_by")
LONGEST_NAME = 200  # chosen: with number and suffix it fits the 255 bytes of a file name
LONGEST_LIST = 64  # chosen: a laser scan has more, and is not a table
BYTES_OF = "pixels"
"""Field of a picture that gets no column."""
TOLD_IN = tuple(f"*/{said}" for said in (Conversation.SCHEDULE, Conversation.ASK, Conversation.STATUS))
"""Keys of the messages by which ``Commanders`` knows them."""
_NO_NAME = re.compile(r"[^\w.-]", re.ASCII)


class FileNames:
    """Names of files, without suffix: one for each key and schema, and the same whenever it is asked for.

    Characters that names in this program do not have are replaced; where two names would then be equal, the later one
    ends with a number.
    """

    def __init__(self) -> None:
        self._names: dict[tuple[str, str], str] = {}

    def of(self, key: str, schema: str = "") -> str:
        """Return the name for a key, or for messages of one schema at a key; versions of a schema share it.

        Example:
            >>> names = FileNames()
            >>> names.of("scout/night/resource_pool/scout1/readings", "Readings/1")
            'resource_pool_scout1_readings_Readings'
            >>> names.of("scout/night/resource_pool/scout1_readings", "Readings/1")
            'resource_pool_scout1_readings_Readings_2'
        """
        named = key, schema.partition("/")[0]
        if named not in self._names:
            parts = filter(None, (*key.split("/")[2:], named[1]))
            name = _NO_NAME.sub("-", "_".join(parts))[:LONGEST_NAME]
            taken = {one.lower() for one in self._names.values()}  # many discs do not tell A from a
            numbered = (name, *(f"{name}_{number}" for number in range(2, len(taken) + 3)))
            self._names[named] = next(one for one in numbered if one.lower() not in taken)
        return self._names[named]


def row_of(message: Recorded, commanded_by: str = "", *, splits_lists: bool = True) -> dict[str, Any]:
    """Return column → value. Fields inside others have their names joined by dots, as ``rcs.0.rc``.

    Args:
        commanded_by: The robot's commander at that time; see ``Commanders``.
        splits_lists: True: each item of a list has a column of its own, and long lists have none. False: a list is one
            value.
    """
    row: dict[str, Any] = {
        "at_s": message.at_s,
        "source": message.source,
        "sequence": message.sequence,
        "cause": message.cause,
        "commanded_by": commanded_by,
    }
    match message.body:
        case dict(fields):
            _fill(row, fields.items(), "", splits_lists=splits_lists)
        case list(items) if splits_lists:
            if len(items) <= LONGEST_LIST:
                _fill(row, enumerate(items), "", splits_lists=splits_lists)
        case bytes(unread):
            row["bytes"] = unread.hex()
        case value:
            row["body"] = value
    return row


def _fill(row: dict[str, Any], parts: Iterable[tuple[object, Any]], before: str, *, splits_lists: bool) -> None:
    """Add the values inside another one, each below its name; where its column is taken, it gets another one."""
    for name, value in parts:
        column = f"{before}{name}"
        if name == BYTES_OF:
            continue
        if isinstance(value, dict):
            _fill(row, value.items(), f"{column}.", splits_lists=splits_lists)
        elif isinstance(value, list) and splits_lists:
            if len(value) <= LONGEST_LIST:
                _fill(row, enumerate(value), f"{column}.", splits_lists=splits_lists)
        else:
            row[f"{column}_" if column in row else column] = value


class Commanders:
    """The commander of each robot at an instant: a person, a behavior, or no one.

    It takes the messages of a recording in their order. Only the ARC that holds a robot moves it, under its epoch.
    Therefore the owner of that ARC commanded the robot's actions, and the view of its camera.

    Args:
        newest_first: The same messages in the opposite order. A recording names the holder of a robot, and the person
            at a console, only after the first messages of both. ``TOLD_IN`` has the keys of these messages.
    """

    def __init__(self, newest_first: Iterable[Recorded] = ()) -> None:
        self._owners: dict[str, str] = {}
        self._users: dict[str, str] = {}
        self._arcs: dict[tuple[str, int], str] = {}
        for message in newest_first:
            self.take(message)

    def take(self, message: Recorded) -> None:
        """Record the owner of each ARC, the ARC of each epoch of an RC, and the person at each console."""
        match message.schema.partition("/")[0], message.body:  # in a foreign message of this name anything may stand
            case "Schedule", dict(schedule):
                self._take_schedule(schedule)
            case "Connect", {"arc": str(arc), "epoch": int(epoch)}:
                self._arcs[component_of(address_of(message.key)), epoch] = arc
            case "ComponentState", {"address": str(address), "user": str(user)} if user:
                self._users[address] = user

    def _take_schedule(self, schedule: Mapping[str, Any]) -> None:
        for request in _listed(schedule.get("requests")):
            match request:
                case {"arc": str(arc), "owner": str(owner)}:
                    self._owners[arc] = owner
        for rc in _listed(schedule.get("rcs")):  # the recording may have begun after the ARC was connected
            match rc:
                case {"rc": str(name), "holders": list(holders)}:
                    self._take_holders(name, holders)

    def _take_holders(self, rc: str, holders: list[Any]) -> None:
        for holder in holders:
            match holder:
                case {"arc": str(arc), "epoch": int(epoch)}:
                    self._arcs[rc, epoch] = arc

    def of(self, message: Recorded) -> str:
        """Return the commander of the robot of this message; empty: none, or the message is of no ARC."""
        match message.body:  # in a module's own message these words may mean anything
            case {"arc": str(arc)} if arc:
                return self.owner_of(arc)
            case {"rc": str(rc), "epoch": int(epoch)}:
                return self.owner_of(self._arcs.get((rc, epoch), ""))
        return ""

    def owner_of(self, arc: str) -> str:
        """Return the owner of an ARC, by the name of the person or behavior; empty: not known."""
        owner = self._owners.get(arc, "")
        return self._users.get(owner, owner.rpartition("/")[2])


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []
