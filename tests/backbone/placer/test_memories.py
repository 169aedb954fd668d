"""What a component leaves for its next process reaches it on whichever host, under the same order."""

from __future__ import annotations

from pathlib import Path

import pytest
from placer_at_work import Mission, on

from backbone.addresses import PLACER
from backbone.placer.memories import Memories
from backbone.placer.messages import AskMemory, KeepMemory, Memory, MemoryKept


async def keep(one: Mission, name: str, order_id: str, content: bytes) -> None:
    bus = one.network.join(f"mission_control/{name}", one.clock)
    await bus.ask(PLACER, KeepMemory(order_id, content), MemoryKept, within_s=1.0)
    await bus.close()


async def kept(one: Mission, name: str, order_id: str) -> bytes:
    bus = one.network.join(f"mission_control/{name}", one.clock)
    memory = await bus.ask(PLACER, AskMemory(order_id), Memory, within_s=1.0)
    await bus.close()
    return memory.content


@on("a")
async def test_a_memory_is_kept_for_the_order_of_its_component_until_an_order_stops_it(one: Mission) -> None:
    await one.start("watcher", "w", order_id="7")
    assert await kept(one, "w", "7") == b""
    await keep(one, "w", "7", b"first")
    await keep(one, "w", "7", b"second")
    await keep(one, "w", "6", b"of an order that is over")
    await keep(one, "other", "7", b"of no component")
    assert [await kept(one, name, order) for name, order in (("w", "7"), ("w", "6"), ("other", "7"))] == [
        b"second",
        b"",
        b"",
    ]
    await one.stop("w")
    await one.start("watcher", "w", order_id="7")
    assert await kept(one, "w", "7") == b""


def test_the_next_placer_knows_the_memories(tmp_path: Path) -> None:
    Memories(str(tmp_path)).keep("w", KeepMemory("7", b"two way points"))
    then = Memories(str(tmp_path))
    assert (then.of("w", "7"), then.of("w", "8"), then.of("v", "7")) == (b"two way points", b"", b"")
    then.forget("w")
    assert Memories(str(tmp_path)).of("w", "7") == b""


def test_a_memory_that_cannot_be_kept_or_read_is_lost_with_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    memories = Memories(str(tmp_path))
    memories.keep("w", KeepMemory("7", b"one"))
    (tmp_path / "kept" / "memories" / "w").write_bytes(b"torn")
    assert Memories(str(tmp_path)).of("w", "7") == b""
    (tmp_path / "kept" / "memories" / "v").mkdir()
    memories.keep("v", KeepMemory("7", b"one"))
    assert memories.of("v", "7") == b"one"
    memories.forget("v")
    assert "the memory of v stays" in caplog.text
    assert "the memory of w is lost" in caplog.text
    assert "a restart of the placer will not know the memory of v" in caplog.text


def test_the_placer_of_a_mission_that_has_ended_keeps_nothing_for_the_next_one(tmp_path: Path) -> None:
    folder = tmp_path / "mission"
    folder.mkdir()
    memories = Memories(str(folder))
    folder.rename(tmp_path / ".mission.ended")
    folder.mkdir()
    memories.keep("w", KeepMemory("7", b"of the former mission"))
    assert list(folder.iterdir()) == []
