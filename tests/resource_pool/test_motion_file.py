"""What a robot's RC publishes of its motions, and keeps for localizers and for its own next process."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from backbone.bus.clock import MissionClock
from backbone.bus.local_bus import LocalNetwork
from backbone.wire import Envelope, Message
from resource_pool.messages import Applied
from resource_pool.published_motions import KEPT, AskLastMove, LastMove, PublishedMotions


def motion(at_s: float) -> Applied:
    return Applied("scout1", 7, at_s, "move", {"forward_m_s": 0.2, "turn_rad_s": 0.0})


def process(folder: Path | str, begun_s: float) -> PublishedMotions:
    """Return the motions of a new process of the RC."""
    bus = LocalNetwork().join("resource_pool/scout1", MissionClock.started_now())
    return PublishedMotions(bus, begun_s, str(folder))


def numbers(motions: PublishedMotions, since_s: float = 0.0) -> list[int]:
    return [one.number for one in motions.since(since_s).motions]


def test_motions_are_numbered_from_1_and_asked_for_by_time() -> None:
    published = process("", 5.0)
    for number in range(4):
        published.publish(motion(6.0 + number))
    assert numbers(published) == [1, 2, 3, 4]
    assert numbers(published, 8.0) == [3, 4]
    assert published.since(0.0).begun_s == 5.0


@pytest.mark.parametrize(
    ("moved_s", "is_kept"), [(None, True), (7.9, True), (8.1, False)], ids=["not since", "one is missing", "elsewhere"]
)
async def test_a_record_of_this_host_ends_if_the_robot_moved_elsewhere_since(
    tmp_path: Path, moved_s: float | None, is_kept: bool
) -> None:
    process(tmp_path, 5.0).publish(motion(7.0))
    network, clock = LocalNetwork(), MissionClock.started_now()
    bus, radio = (network.join(f"resource_pool/{name}", clock) for name in ("scout1", "radio"))
    nxt = PublishedMotions(bus, 20.0, str(tmp_path))
    await nxt.ask_before(radio.source, 1, within_s=1)
    assert nxt.since(0.0).begun_s == 5.0, "no radio answers"
    told = LastMove(1.0, moved_s)

    async def answer(asked: Envelope[Message]) -> Message:
        assert asked.body == AskLastMove(1)
        return told

    radio.serve(radio.source, AskLastMove, answer)
    await nxt.ask_before(radio.source, 1, within_s=1)
    motions = nxt.since(0.0)
    assert (motions.begun_s, motions.before) == ((5.0, None) if is_kept else (20.0, told))
    nxt.publish(motion(21.0))
    assert numbers(nxt) == ([1, 2] if is_kept else [1])
    assert numbers(process(tmp_path, 30.0)) == numbers(nxt)


@pytest.mark.parametrize("count", [1, 2, KEPT, KEPT + 1, 2 * KEPT + 2, 5 * KEPT])
def test_the_next_process_continues_with_the_last_motions_of_the_former(tmp_path: Path, count: int) -> None:
    former = process(tmp_path, 5.0)
    for number in range(count):
        former.publish(motion(6.0 + number))
    nxt = process(tmp_path, 9000.0)
    assert nxt.since(0.0) == former.since(0.0)
    assert numbers(nxt) == list(range(max(1, count - KEPT + 1), count + 1))
    nxt.publish(motion(9001.0))
    assert numbers(nxt, 9000.0) == [count + 1]
    assert numbers(process(tmp_path, 9999.0))[-1] == count + 1
    [file] = (tmp_path / "kept" / "motions").iterdir()
    assert len(file.read_bytes().splitlines()) <= 2 * KEPT + 1


def test_the_line_of_a_process_that_was_killed_while_it_wrote_is_left_out(tmp_path: Path) -> None:
    former = process(tmp_path, 5.0)
    for at_s in (6.0, 7.0):
        former.publish(motion(at_s))
    file = tmp_path / "kept" / "motions" / "scout1"
    file.write_bytes(file.read_bytes()[:-5])
    nxt = process(tmp_path, 9.0)
    assert (nxt.since(0.0).begun_s, numbers(nxt)) == (5.0, [1])
    nxt.publish(motion(10.0))
    assert numbers(process(tmp_path, 11.0)) == [1, 2]


@pytest.mark.parametrize("content", [b"", b"torn", b"5.0\n{}\n", b"{}\n", b"\xff\n"])
def test_a_file_that_cannot_be_read_means_that_earlier_motions_are_not_known(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "kept" / "motions").mkdir(parents=True)
    (tmp_path / "kept" / "motions" / "scout1").write_bytes(content)
    nxt = process(tmp_path, 9.0)
    assert (nxt.since(0.0).begun_s, numbers(nxt)) == (9.0, [])


@pytest.mark.parametrize("fails_at", ["begin", "add"])
def test_a_file_that_lacks_a_motion_is_removed(
    tmp_path: Path, fails_at: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    former = process(tmp_path, 5.0)
    former.publish(motion(6.0))
    published = process(tmp_path, 6.5)
    if fails_at == "add":
        published.publish(motion(7.0))

    def full(*_: Any, **__: Any) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as disk:
        disk.setattr("resource_pool.motion_file.replace_file", full)
        disk.setattr(Path, "open", full)
        published.publish(motion(8.0))
    published.publish(motion(9.0))
    assert "No space left" in caplog.text
    assert list((tmp_path / "kept" / "motions").iterdir()) == []
    assert numbers(published)[-1] == numbers(published)[0] + len(numbers(published)) - 1
