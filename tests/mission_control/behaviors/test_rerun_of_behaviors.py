"""A behavior that is run again on a recording says the same to the byte, and another one is found out at once."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from behaviors_at_work import example
from recorded_missions import CLASSES, record_mission

from backbone.command_line.replaying import run_without
from backbone.component.class_path import load_class
from backbone.launcher.endings import ExitCode
from backbone.recording.comparison import compared
from backbone.recording.reader import Recorded, Recording
from backbone.recording.rerun import RealComponent, launch_of, run_again

PATROL, SERVO = "patrol-scout1", "servo-scout3"
LASTED_S = 10.0
MOVE = "Move/1"
Said = dict[tuple[str, str], list[tuple[str, bytes]]]


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("rerun") / "it.mcap"
    record_mission(made, example(PATROL, SERVO), LASTED_S)
    return made


@pytest.fixture(scope="module")
def recording(path: Path) -> Iterator[Recording]:
    with path.open("rb") as file:
        yield Recording(file)


def rerun_of(recording: Recording, name: str, **parameters: Any) -> tuple[list[Recorded], list[Recorded]]:
    """Return what the component said then, and what it says on the recording."""
    launch = launch_of(recording, CLASSES, name)
    launch = msgspec.structs.replace(launch, parameters={**launch.parameters, **parameters})
    rerun = run_again(recording, CLASSES, [RealComponent(launch, load_class(launch.class_path))])
    assert rerun.fell == {}
    return [*recording.messages(source=launch.address)], [*rerun.said]


def bytes_by_key(messages: Iterable[Recorded]) -> Said:
    """Return causes and bytes of the messages of each key and schema, in their order."""
    found: Said = defaultdict(list)
    for message in messages:
        found[message.key, message.schema].append((message.cause, msgspec.json.encode(message.body)))
    return found


@pytest.mark.parametrize("name", [PATROL, SERVO])
def test_all_that_it_says_is_the_same_to_the_byte_with_its_causes(recording: Recording, name: str):
    then, now = map(bytes_by_key, rerun_of(recording, name))
    assert then.keys() == now.keys()
    for key, said in then.items():
        assert now[key] == said, key
    assert sum(len(said) for (_key, schema), said in then.items() if schema == MOVE) > 100


async def test_the_command_tells_both(path: Path, capsys: pytest.CaptureFixture[str]):
    assert await run_without(path, [PATROL], "", {}, {}, as_json=False) is ExitCode.DONE
    assert capsys.readouterr().out == ""
    assert await run_without(path, [PATROL], "", {"speed_m_s": 0.19}, {}, as_json=False) is ExitCode.REFUSED
    told = capsys.readouterr()
    assert "patrol-scout1-drive/ask  Move" in told.out
    assert "; the first is message 0 of " in told.err


def test_there_is_something_to_decide(recording: Recording):
    schemas = {one.schema for one in recording.messages(("mission_control/*/*",))}
    assert {"WaypointReached/1", "LandmarkSighting/1"} <= schemas


@pytest.mark.parametrize(
    ("name", "patched", "parameters"),
    [
        pytest.param(PATROL, {}, {"reached_within_m": 0.1}, id="a threshold of a patrol"),
        pytest.param(
            PATROL,
            {"mission_control.behaviors.motion.TURN_PER_S": 2.51},
            {},
            id="a gain of a patrol",
            marks=pytest.mark.thorough,
        ),
        pytest.param(
            SERVO,
            {"mission_control.vision.servo_law.STRAIGHT_RAD": 0.2},
            {},
            id="a threshold of servoing",
            marks=pytest.mark.thorough,
        ),
        pytest.param(SERVO, {"mission_control.vision.servo_law.BEARING_GAIN_HZ": 2.51}, {}, id="a gain of servoing"),
    ],
)
def test_another_value_is_named_at_the_first_command_that_differs(
    recording: Recording,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    patched: dict[str, float],
    parameters: dict[str, float],
):
    for target, value in patched.items():
        monkeypatch.setattr(target, value)
    then, now = rerun_of(recording, name, **parameters)
    [found] = [one for (_key, _source, schema), one in compared(then, now).items() if schema == MOVE]
    assert found.difference is not None
    moves_then, moves_now = ([one for one in said if one.schema == MOVE] for said in (then, now))
    number = found.difference.number
    assert number > 0, "before the difference it says the same"
    assert [one.body for one in moves_then[:number]] == [one.body for one in moves_now[:number]]
    assert moves_then[number].body != moves_now[number].body
    assert found.difference.first_s == moves_then[number].at_s
    assert moves_then[number].body[found.difference.field] == found.difference.first
    assert moves_now[number].body[found.difference.field] == found.difference.second
