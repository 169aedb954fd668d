"""A zygote imports the ordered modules beforehand, and can fork after any import."""

from __future__ import annotations

import asyncio
import json
import resource
from pathlib import Path

import msgspec
import pytest

from backbone.component.launch import Launch
from backbone.component.process import EXIT_REFUSED
from backbone.creator.zygote import NoProcess, Zygote
from backbone.naming import Subsystem

pytestmark = [pytest.mark.processes, pytest.mark.timeout(60)]

MODULES = {
    "arc_that_is_well": "",
    "arc_with_a_bug": "1 / 0",
    "arc_with_a_thread": "import threading, time\nthreading.Thread(target=time.sleep, args=(60,), daemon=True).start()",
    "another_arc": "",
}
PROBE = """
import json, os, sys
from pathlib import Path
found = {"modules": [m for m in %r if m in sys.modules], "threads": len(os.listdir("/proc/self/task"))}
Path(__file__).with_suffix(".json").write_text(json.dumps(found))
"""


LIMITS = """
import json, resource
from pathlib import Path
Path(__file__).with_suffix(".json").write_text(json.dumps(resource.getrlimit(resource.RLIMIT_NOFILE)))
"""


async def test_what_fails_or_starts_threads_is_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, text in {**MODULES, "probe": PROBE % list(MODULES)}.items():
        (tmp_path / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path))
    zygote = await Zygote.spawn_fresh(run_directory=str(tmp_path / "run"), preload=MODULES)
    ended: asyncio.Future[tuple[int, int]] = asyncio.get_running_loop().create_future()
    zygote.on_exit = lambda pid, code: ended.set_result((pid, code))
    try:
        before = zygote.pid
        launch = Launch("m", Subsystem.BACKBONE, "one", "one", "probe:NoComponent", "here", "tcp/127.0.0.1:1", 0.0, 1.0)
        pid = await zygote.fork(launch)
        assert await asyncio.wait_for(ended, 20) == (pid, EXIT_REFUSED)
        told = (tmp_path / "run" / "log" / "zygote.log").read_text()
        assert zygote.pid == before
    finally:
        await zygote.close()
    assert json.loads((tmp_path / "probe.json").read_text()) == {
        "modules": ["arc_that_is_well", "another_arc"],
        "threads": 1,
    }
    assert "arc_with_a_bug is not preloaded" in told
    assert "arc_with_a_thread starts threads" in told


async def test_components_may_open_as_many_files_as_the_system_allows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "limits.py").write_text(LIMITS)
    monkeypatch.syspath_prepend(str(tmp_path))
    usual, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (usual - 1, most))
    try:
        zygote = await Zygote.spawn_fresh(run_directory=str(tmp_path / "run"), preload=("limits",))
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (usual, most))
    await zygote.close()
    assert json.loads((tmp_path / "limits.json").read_text()) == [most, most]


async def test_a_launch_that_cannot_be_sent_is_refused_and_moves_no_other_answer(tmp_path: Path) -> None:
    zygote = await Zygote.spawn_fresh(run_directory=str(tmp_path / "run"))
    ends: asyncio.Queue[int] = asyncio.Queue()
    zygote.on_exit = lambda pid, _code: ends.put_nowait(pid)
    launch = Launch("m", Subsystem.BACKBONE, "one", "one", "no:Component", "here", "tcp/127.0.0.1:1", 0.0, 1.0)
    try:
        for unsendable in ("caf\udce9", 2**64):
            with pytest.raises(NoProcess, match="cannot be sent"):
                await zygote.fork(msgspec.structs.replace(launch, parameters={"trace": unsendable}))
        async with asyncio.timeout(20):
            assert await zygote.fork(launch) == await ends.get()
    finally:
        await zygote.close()
