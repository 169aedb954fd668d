"""Entry points of both command lines: no Ctrl-C is lost, not even while Python imports a module.

Python drops an exception that is raised inside a destructor or a callback of a weak reference. Each import runs such a
callback, so a Ctrl-C at that moment would be printed as "ignored", and the program would go on. A library in another
language may make another exception of it, which would be printed as a bug.
"""

from __future__ import annotations

import _thread
import signal
import sys
from contextlib import suppress
from importlib import import_module
from types import FrameType


def scout_backbone() -> None:
    """Run the command line ``scout-backbone``."""
    _run("backbone.command_line.cli")


def scout_console() -> None:
    """Run the command line ``scout-console``."""
    _run("ui_console.cli")


def _run(module: str) -> None:
    sys.unraisablehook = interrupt_again
    interrupts: list[int] = []

    def interrupted(number: int, _frame: FrameType | None) -> None:
        interrupts.append(number)
        raise KeyboardInterrupt

    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it is ignored, as in a shell's background
        signal.signal(signal.SIGINT, interrupted)
    try:
        import_module(module).main()
    except KeyboardInterrupt:  # the module was not imported yet, so nothing can print
        _end_by_interrupt()
    except Exception:
        if not interrupts:
            raise
        _end_by_interrupt()


def _end_by_interrupt() -> None:
    """End as Ctrl-C does by default; a shell makes 130 of this end."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.raise_signal(signal.SIGINT)


def interrupt_again(dropped: sys.UnraisableHookArgs) -> None:
    """Repeat an interrupt that Python dropped; report any other dropped exception as Python does.

    Another thread sends it: sent by this one, its exception would be raised in here and dropped, too.
    """
    if issubclass(dropped.exc_type, KeyboardInterrupt):
        with suppress(RuntimeError):  # the program ends already: Python 3.12 then begins no thread
            _thread.start_new_thread(signal.pthread_kill, (_thread.get_ident(), signal.SIGINT))
    else:
        sys.__unraisablehook__(dropped)
