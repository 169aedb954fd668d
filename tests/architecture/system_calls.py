"""Finds where the packages use what Python offers on some systems only."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


IMPORTS = _words(
    """_posixsubprocess ctypes evdev fcntl grp mmap posix pty pwd resource select syslog termios tty uvloop"""
)
"""Modules that are there on some systems only, or that call into a C library by its name."""
OS = _words(
    """O_CLOEXEC O_DIRECTORY O_NOFOLLOW O_NONBLOCK WNOHANG chown eventfd fchmod fchown fork forkpty geteuid getgid
    getgroups getlogin getpgid getpriority getsid getuid initgroups kill killpg memfd_create mkfifo nice openpty
    pidfd_open posix_spawn pread pwrite register_at_fork sched_getaffinity sched_setaffinity sched_setscheduler
    setpgid setpriority setsid setuid statvfs sysconf umask uname wait wait4 waitid waitpid"""
)
SIGNALS = _words(
    """SIGALRM SIGCHLD SIGCONT SIGHUP SIGKILL SIGPIPE SIGQUIT SIGSTOP SIGTSTP SIGUSR1 SIGUSR2 SIGWINCH alarm pause
    pthread_kill pthread_sigmask setitimer sigwait sigtimedwait"""
)
SOCKETS = _words("""AF_UNIX SO_LINGER SO_PEERCRED SO_REUSEPORT TCP_NOTSENT_LOWAT SCM_RIGHTS send_fds recv_fds""")
METHODS = _words(
    """add_reader add_signal_handler add_writer create_unix_connection create_unix_server open_unix_connection
    start_unix_server"""
)
"""Methods of event loops, and functions of asyncio, that some systems' loops lack."""
FOLDERS = ("/proc", "/sys/", "/dev/")


def system_calls(source: str) -> set[str]:
    """Return what a file uses of some systems only, as a reader would write it.

    Example:
        >>> sorted(system_calls("import os, fcntl\\nos.kill(1, 2)"))
        ['fcntl', 'os.kill']
    """
    return calls_among([*ast.walk(ast.parse(source))])


def calls_among(nodes: Sequence[ast.AST]) -> set[str]:
    """Return the same of all nodes of a file."""
    return set(_found(nodes))


def _found(nodes: Sequence[ast.AST]) -> Iterator[str]:
    documents = {id(text) for node in nodes for text in _documents(node)}
    for node in nodes:
        match node:
            case ast.Import(names=names):
                yield from (one.name for one in names if one.name.partition(".")[0] in IMPORTS)
            case ast.ImportFrom(module=str(module), names=names, level=0):
                if module.partition(".")[0] in IMPORTS:
                    yield module
                yield from (f"{module}.{one.name}" for one in names if one.name in _attributes(module))
            case ast.Attribute(value=ast.Name(id=module), attr=name) if name in _attributes(module):
                yield f"{module}.{name}"
            case ast.Attribute(attr=name) if name in METHODS:
                yield name
            case ast.Constant(value=str(text)) if text.startswith(FOLDERS) and id(node) not in documents:
                yield next(folder for folder in FOLDERS if text.startswith(folder))
            case _:
                pass


def _attributes(module: str) -> frozenset[str]:
    return {"os": OS, "signal": SIGNALS, "socket": SOCKETS}.get(module, frozenset())


def _documents(node: ast.AST) -> Iterator[ast.AST]:
    """Yield strings that stand alone: docstrings."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        yield node.value
