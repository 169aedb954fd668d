"""Lingering closes: this process's threads cannot make the close of a socket wait.

A library that sets ``SO_LINGER`` blocks the thread that closes a socket until the peer has acknowledged all data. The
option cannot be reset in time if the library closes the socket in the same moment in which it accepted it. So the
kernel itself ignores the option, by a filter of system calls (seccomp).
"""

from __future__ import annotations

import ctypes
import logging
import os
import platform
import socket
import struct

log = logging.getLogger(__name__)

_MACHINES = {"x86_64": (0xC000003E, 317, 54), "aarch64": (0xC00000B7, 277, 208)}
"""Machine → its number in linux/audit.h, and those of seccomp and setsockopt in asm/unistd.h."""
_PR_SET_NO_NEW_PRIVS, _SET_FILTER, _SPEC_ALLOW = 38, 1, 4  # linux/prctl.h, linux/seccomp.h
_LOAD, _JUMP_IF_EQUAL, _RETURN = 0x20, 0x15, 0x06  # linux/bpf_common.h: BPF_LD|BPF_ABS, BPF_JMP|BPF_JEQ, BPF_RET
_NUMBER_AT, _MACHINE_AT, _LEVEL_AT, _OPTION_AT = 0, 4, 24, 32  # linux/seccomp.h: struct seccomp_data
_DONE, _ALLOW = 0x0005_0000, 0x7FFF_0000  # linux/seccomp.h: SECCOMP_RET_ERRNO with 0, SECCOMP_RET_ALLOW


class _Program(ctypes.Structure):
    _fields_ = (("length", ctypes.c_ushort), ("instructions", ctypes.c_char_p))


def ignore_lingering() -> bool:
    """Let ``SO_LINGER`` have no effect in this thread and those that it starts; return whether it is so now.

    The call that sets the option succeeds. On other machines than those of ``_MACHINES``, and where the kernel has no
    filters, nothing changes. The process cannot gain privileges any more.
    """
    if (machine := _MACHINES.get(platform.machine())) is None:
        return False
    number, seccomp, setsockopt = machine
    instructions = _filter(number, setsockopt)
    libc, program = ctypes.CDLL(None, use_errno=True), _Program(len(instructions) // 8, instructions)
    failed = libc.prctl(_PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) or libc.syscall(
        seccomp, _SET_FILTER, _SPEC_ALLOW, ctypes.byref(program)
    )
    if failed:
        reason = os.strerror(ctypes.get_errno())
        log.warning("a poor link may stop the hub for seconds, because system calls are not filtered: %s", reason)
    return not failed


def _filter(machine: int, setsockopt: int) -> bytes:
    """Return a program that answers ``setsockopt(_, SOL_SOCKET, SO_LINGER, …)`` and allows every other call."""
    asked = [
        (_MACHINE_AT, machine),
        (_NUMBER_AT, setsockopt),
        (_LEVEL_AT, socket.SOL_SOCKET),
        (_OPTION_AT, socket.SO_LINGER),
    ]
    lines = []
    for left, (at, value) in zip(range(len(asked) - 1, -1, -1), asked, strict=True):
        lines += [(_LOAD, 0, 0, at), (_JUMP_IF_EQUAL, 0, 2 * left + 1, value)]  # else to the last line
    return b"".join(struct.pack("HBBI", *line) for line in [*lines, (_RETURN, 0, 0, _DONE), (_RETURN, 0, 0, _ALLOW)])
