"""What must hold before a mission is brought up: nothing is started, and nothing of it is left, if it does not."""

from __future__ import annotations

import socket
from pathlib import Path

from backbone import run_files
from backbone.door import SECRET_NAME, keep_secret, new_secret, socket_endpoint
from backbone.errors import Refusal
from backbone.mission.model import Host, MissionDescription


class MissionAlreadyUp(Refusal):
    """A mission of this name runs on this machine."""

    code = "run.already_up"
    remedy = "Take it down with 'scout-backbone down', or give this one another name."


class PortTaken(Refusal):
    """The hub cannot listen for other machines where the mission file says."""

    code = "run.port"
    remedy = "State another port or address at the mission's first host, or stop what listens there."


def refuse_if_up(mission: str) -> None:
    """Return if no mission of this name runs on this machine.

    Raises:
        MissionAlreadyUp: One does.
    """
    try:
        running = run_files.find(mission)
    except run_files.MissionNotUp:
        return
    raise MissionAlreadyUp(
        f"mission {mission} is up since before, launcher process {running.launcher_pid}", pid=running.launcher_pid
    )


def make_door(description: MissionDescription, directory: Path) -> str:
    """Return where the hub will listen on this machine; with other machines their secret lies beside it afterwards.

    The secret is a new one, so that nothing of an earlier run can speak to this one.

    Raises:
        SocketPathTooLong: The folder's path is too long for a socket.
        PortTaken: The hub could not listen for the other machines.
    """
    endpoint = socket_endpoint(directory)
    (directory / SECRET_NAME).unlink(missing_ok=True)
    if description.other_hosts:
        _refuse_taken_port(description.hosts[0])
        keep_secret(directory, new_secret())
    return endpoint


def _refuse_taken_port(host: Host) -> None:
    """Return if a hub can listen at the host's address and port.

    Raises:
        PortTaken: It cannot.
    """
    try:
        family, kind, protocol, _, where = socket.getaddrinfo(host.address, host.port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(where)
            probe.listen()
    except OSError as error:
        raise PortTaken(f"port {host.port} of {host.address}: {error.strerror or error}", port=host.port) from error
