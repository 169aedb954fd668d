"""Preconditions of a bring-up. If one fails, nothing is started and no file of the mission is left."""

from __future__ import annotations

import errno
import socket
from pathlib import Path

from backbone import run_files
from backbone.authentication import SECRET_NAME, keep_secret, new_secret, socket_endpoint
from backbone.errors import Refusal
from backbone.mission.model import Host, MissionDescription
from backbone.operating_system import own_process, processes

LEAST_FILES = 256  # chosen: the hubs of the examples open up to 120; people attach, and processes start again


class MissionAlreadyUp(Refusal):
    """A mission of this name runs on this machine."""

    code = "run.already_up"
    remedy = "Take it down with 'scout-backbone down', or give this one another name."


class PortTaken(Refusal):
    """The hub cannot listen for other machines at the address and port of the mission file."""

    code = "run.port"
    remedy = "State another port or address at the mission's first host, or stop what listens there."


class PathNotUtf8(Refusal):
    """A path has a byte that is no UTF-8, so no message can contain it."""

    code = "run.path"
    remedy = "Rename that file or folder, or use one whose whole path is UTF-8."


class NoProcessTable(Refusal):
    """The system does not show its processes, so none can be watched."""

    code = "run.no_processes"
    remedy = f"Mount it: {processes.MOUNTS_TABLE!r}, or start the container or service so that it sees it."


class TooFewFiles(Refusal):
    """The system lets a process open fewer files than a hub needs."""

    code = "run.files"
    remedy = "Raise the limit: 'ulimit -n 4096' in a shell, LimitNOFILE=4096 in a service."


def require_files() -> None:
    """Return if a process may open as many files as the hub of a small mission needs, else raise.

    Raises:
        TooFewFiles: It may not.
    """
    most = own_process.most_files()
    if most < LEAST_FILES:
        raise TooFewFiles(f"a process may open {most} files; the hub needs {LEAST_FILES} or more")


def require_process_table() -> None:
    """Return if the processes of a mission can be watched here, else raise.

    Raises:
        NoProcessTable: They cannot.
    """
    if not processes.is_table_readable():
        raise NoProcessTable(f"{processes.TABLE} of this machine cannot be read, so no process can be watched")


def refuse_paths_of_no_message(mission: str, *paths: str | Path) -> None:
    """Return if messages can contain these paths and that of the mission's folder, else raise.

    Raises:
        PathNotUtf8: A path has a byte that is no UTF-8.
        UnsafeDirectory: Another user could write files into the mission's folder.
        RunFolderUnusable: The system refused the mission's folder.
    """
    for path in (run_files.run_directory(mission), *paths):
        try:
            str(path).encode()
        except UnicodeEncodeError as error:
            raise PathNotUtf8(f"the path {str(path)!r} has a byte that is no UTF-8") from error


def refuse_if_up(mission: str) -> None:
    """Return if no mission of this name runs on this machine, else raise.

    Raises:
        MissionAlreadyUp: A mission of this name runs.
    """
    try:
        running = run_files.find(mission)
    except run_files.MissionNotUp:
        return
    raise MissionAlreadyUp(
        f"mission {mission} is up already, launcher process {running.launcher_pid}", pid=running.launcher_pid
    )


def prepare_endpoint(description: MissionDescription, directory: Path) -> str:
    """Return the endpoint of the hub on this machine; if the mission has other machines, write their secret beside it.

    Each run has a new secret, so that components of an earlier run cannot reach this one.

    Raises:
        SocketPathTooLong: The folder's path is too long for a socket.
        SocketPathCut: The folder's path has a character that ends the path of an endpoint.
        PortTaken: The hub cannot listen for the other machines.
    """
    endpoint = socket_endpoint(directory)
    (directory / SECRET_NAME).unlink(missing_ok=True)
    if description.other_hosts:
        _refuse_taken_port(description.hosts[0])
        keep_secret(directory, new_secret())
    return endpoint


def has_address(host: Host) -> bool:
    """Return whether this machine has the host's address; True also for a name, which may mean any address."""
    try:
        found = socket.getaddrinfo(host.address, 0, type=socket.SOCK_DGRAM, flags=socket.AI_NUMERICHOST)
        family, kind, protocol, _, where = found[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.bind(where)
    except OSError as error:
        return error.errno != errno.EADDRNOTAVAIL
    return True


def _refuse_taken_port(host: Host) -> None:
    """Return if a hub can listen at the host's address and port, else raise.

    Raises:
        PortTaken: The port is in use, or the address is not this machine's.
    """
    try:
        family, kind, protocol, _, where = socket.getaddrinfo(host.address, host.port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind, protocol) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(where)
            probe.listen()
    except OSError as error:
        raise PortTaken(f"port {host.port} of {host.address}: {error.strerror or error}", port=host.port) from error
