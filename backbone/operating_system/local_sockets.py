"""Sockets between processes of one user on one machine. Their names end with their processes: no file is left.

Packets arrive whole, in order, or not at all, and no call ever blocks. Only Linux has such names. They belong to the
network namespace, so processes in different network namespaces cannot connect.
"""

from __future__ import annotations

import os
import socket
import struct
import sys

IS_POSSIBLE = sys.platform == "linux"
_PEER = struct.Struct("iII")  # struct ucred, unix(7): pid, user, group
_BESIDE_PACKET_BYTES = 32  # Linux, net/unix/af_unix.c, unix_dgram_sendmsg: a longer packet is refused (EMSGSIZE)
_NAME_BYTES = 12  # chosen: no other process takes the same name by chance


def listen() -> tuple[socket.socket, str]:
    """Return a socket that accepts connections, and its name.

    Raises:
        OSError: The system refuses the socket.
    """
    name = os.urandom(_NAME_BYTES).hex()
    made = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        made.setblocking(False)
        made.bind(_at(name))
        made.listen()
    except BaseException:
        made.close()
        raise
    return made, name


def connect(name: str) -> socket.socket:
    """Return a connection to the process of this user that listens at the name.

    Raises:
        OSError: No process listens there, it accepts no connection now, or it belongs to another user.
    """
    made = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        made.setblocking(False)
        made.connect(_at(name))
        require_own(made)
    except BaseException:
        made.close()
        raise
    return made


def accept(listening: socket.socket) -> socket.socket:
    """Return the next connection.

    Raises:
        BlockingIOError: No connection waits.
        PermissionError: The connection was another user's, and is closed.
        OSError: The system refuses the connection.
    """
    made, _address = listening.accept()
    try:
        made.setblocking(False)
        require_own(made)
    except BaseException:
        made.close()
        raise
    return made


def most_packet_bytes(connected: socket.socket) -> int:
    """Return the length of the longest packet that this end can send, however much waits."""
    return connected.getsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF) - _BESIDE_PACKET_BYTES


def require_own(connected: socket.socket) -> None:
    """Return if the process at the other end belongs to this user.

    Raises:
        PermissionError: It belongs to another user.
    """
    if not is_own(connected):
        raise PermissionError(f"the process at the other end belongs to user {_user_of(connected)}")


def is_own(connected: socket.socket) -> bool:
    """Return whether the process at the other end belongs to this user."""
    return _user_of(connected) == os.geteuid()


def _user_of(connected: socket.socket) -> int:
    _pid, user, _group = _PEER.unpack(connected.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _PEER.size))
    return int(user)


def _at(name: str) -> str:
    return f"\0scout-backbone/{name}"
