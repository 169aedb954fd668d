"""The machines of a mission except its first, and whether each has a creator in the mission.

Pure: liveliness tokens go in, absences come out. This file starts no machine: a person or the machine's own service
manager runs the command on a missing machine.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec

from backbone.authentication import SECRET_NAME, tcp_endpoint
from backbone.component.messages import Absence
from backbone.creator.messages import creator_name, offer_name
from backbone.mission.model import Host, MissionDescription
from backbone.naming import Subsystem, address

ADDRESS_BACK = "Give that machine its address again, or take the mission down and write the new one into its file."


def endpoint_for_others(description: MissionDescription) -> str:
    """Return the endpoint at which the mission's other machines reach its hub; empty if it has none."""
    first = description.hosts[0]
    return tcp_endpoint(first.address, first.port) if description.other_hosts else ""


def command_on(host: Host, description: MissionDescription, record: Path | None = None) -> str:
    """Return the command that offers this machine; the file ``secret`` is a copy of the mission's secret.

    Args:
        record: Recording of the mission on its first host; None: it is not recorded.
    """
    words = ["scout-backbone", "creator", "--host", host.name, "--connect", endpoint_for_others(description)]
    words += ["--mission", description.name, *(word for tag in host.tags for word in ("--tag", tag))]
    own = ["--record", record.with_stem(f"{record.stem}-{host.name}").name] if record is not None else []
    return shlex.join([*words, "--secret-file", SECRET_NAME, *own])


@dataclass
class _Absent:
    since_s: float
    cause: str
    was_there: bool = True


class OtherHosts:
    """The other machines of a mission, present or missing.

    Args:
        now_s: Mission time since which they count as missing.
        record: Recording of the mission on its first host; None: it is not recorded.
        has_address: Returns whether this machine still has the address of this host, the mission's first one.
    """

    def __init__(
        self,
        description: MissionDescription,
        now_s: float,
        record: Path | None = None,
        has_address: Callable[[Host], bool] = lambda _host: True,
    ) -> None:
        self._first, self._has_address = description.hosts[0], has_address
        self._commands = {host.name: command_on(host, description, record) for host in description.other_hosts}
        self.names = list(self._commands)
        """Names of all other machines, in the order of the mission file."""
        self._creators = {address(Subsystem.BACKBONE, creator_name(host)): host for host in self._commands}
        self._absent = {
            host: _Absent(now_s, "it was not offered to the mission yet", was_there=False) for host in self._commands
        }
        self._offering: set[str] = set()

    @property
    def missing(self) -> list[str]:
        """Names of the machines without a creator in the mission."""
        return [host for host in self._commands if host in self._absent]

    @property
    def lost(self) -> list[str]:
        """Names of the machines that had a creator in the mission and have none now."""
        return [host for host in self.missing if self._absent[host].was_there]

    def lost_since(self, since_s: float) -> list[str]:
        """Return the machines that were lost after this mission time."""
        return [host for host in self.lost if self._absent[host].since_s > since_s]

    @property
    def offering(self) -> list[str]:
        """Addresses of the present offers, which keep the creators of other machines, declared or not."""
        return sorted(self._offering)

    def command(self, host: str) -> str:
        """Return the command that offers this machine."""
        return self._commands[host]

    def token_changed(self, changed: str, stands: bool, now_s: float) -> bool:
        """Record a change of a liveliness token; return whether it added or removed a machine."""
        if changed.startswith(address(Subsystem.BACKBONE, offer_name(""))):
            (self._offering.add if stands else self._offering.discard)(changed)
        host = self._creators.get(changed)
        if host is None or stands is (host not in self._absent):
            return False
        if stands:
            del self._absent[host]
        else:
            self._absent[host] = _Absent(now_s, "its creator is gone: it ended, or the link to that machine is cut")
        return True

    def absences(self) -> list[Absence]:
        """Return the machines that are missing, with the remedy for each."""
        missing = [
            Absence(host, absent.since_s, absent.cause, "waits for its creator", f"type there: {command}")
            for host, command in self._commands.items()
            if (absent := self._absent.get(host)) is not None
        ]
        if not missing or self._has_address(self._first):
            return missing
        cause = f"{self._first.name} does not have the address {self._first.address} any more"
        return [msgspec.structs.replace(one, cause=cause, remedy=ADDRESS_BACK) for one in missing]
