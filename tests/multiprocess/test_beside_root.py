from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = "import asyncio, beside_root; asyncio.run(beside_root.attend())"
WITHIN_S = 40.0


@pytest.mark.processes
@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another account")
def test_processes_of_another_account_keep_no_zygote_from_its_work() -> None:
    """A name like a zygote's is free to all accounts, and a driver may run its device's program by sudo."""
    path = os.pathsep.join([str(Path(__file__).parent), *filter(None, sys.path)])
    command, environment = [sys.executable, "-c", PROGRAM], {**os.environ, "PYTHONPATH": path}
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, env=environment) as program:
        try:
            assert program.stdout is not None
            program.wait(WITHIN_S)
        finally:
            assert program.stdin is not None
            program.stdin.close()  # ends the processes of root
            program.kill()
        printed = program.stdout.read().splitlines()
    assert printed == ["Alone has ended", "WithSudo has ended", "the zygote has ended"]
