"""A console that is broken on purpose: it crashes when the key j is pressed. Run it with the words of the command."""

from __future__ import annotations

import sys

from ui_console import cli
from ui_console.terminal.app import ConsoleApp


def crash(_console: ConsoleApp) -> None:
    raise ZeroDivisionError("this console is broken on purpose")


if __name__ == "__main__":
    ConsoleApp.action_jump = crash  # type: ignore[method-assign,assignment]
    sys.argv = sys.argv[1:]
    cli.main()
