"""A kind of robot whose body and program do not fit each other is found before a world runs."""

from __future__ import annotations

import re
import sys
from importlib import resources
from pathlib import Path

import pytest

from resource_pool.simulated_world import NoSuchBody, SimulatedWorld
from scout_model.description import SCOUT
from scout_model.errors import InvalidWorld
from scout_model.robot_trial import require_robot

MJCF = resources.files("scout_model").joinpath("scout.xml").read_text()
ANOTHER_WHEEL = re.sub(r'(<velocity name|actuator)="left_wheel"', r'\1="port_wheel"', MJCF)
OPTION_LINE = MJCF[: MJCF.index("<worldbody>")].count("\n") + 1
OPTION = MJCF.replace("<worldbody>", '<option timestep="0.1"/><worldbody>')
KIND = "own_trial.robot:Own"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "own_trial").mkdir()
    (tmp_path / "own_trial" / "robot.py").write_text(
        "from pathlib import Path\nfrom scout_model.scout import Scout\n\nclass Own(Scout):\n    @classmethod\n"
        "    def body_mjcf(cls):\n        return Path(__file__).with_name('own.xml').read_text()\n"
    )
    for name in [name for name in sys.modules if name.startswith("own_trial")]:
        del sys.modules[name]
    return tmp_path / "own_trial"


@pytest.mark.parametrize(
    ("mjcf", "told"),
    [
        (ANOTHER_WHEEL, f"{KIND} drives 'left_wheel', but the actuators of its body are: port_wheel, right_wheel"),
        (
            OPTION,
            f"line {OPTION[: OPTION.index('<option timestep')].count(chr(10)) + 1}: a body must not have <option>",
        ),
        (MJCF.replace("<worldbody>", "<visual/><worldbody>"), "a body must not have <visual>"),
    ],
    ids=["actuator", "option", "visual"],
)
def test_a_fault_of_a_body_is_told_with_its_file(folder: Path, mjcf: str, told: str) -> None:
    (folder / "own.xml").write_text(mjcf)
    with pytest.raises(InvalidWorld, match=re.escape(told)) as refused:
        require_robot(KIND)
    assert str(refused.value).startswith(str(folder / "own.xml"))


def test_a_sensor_of_a_renamed_actuator_is_named(folder: Path) -> None:
    """MuJoCo drops such a sensor if the body is attached to a world."""
    (folder / "own.xml").write_text(MJCF.replace('<velocity name="left_wheel"', '<velocity name="port_wheel"'))
    with pytest.raises(InvalidWorld, match=r"unrecognized name 'left_wheel' of sensorized object"):
        require_robot(KIND)


def test_a_sensor_that_the_program_reads_in_vain_is_named_with_the_line_of_the_program(folder: Path) -> None:
    (folder / "own.xml").write_text(MJCF.replace('<accelerometer name="accelerometer"', '<accelerometer name="speed"'))
    with pytest.raises(
        NoSuchBody, match=r"own_trial.robot:Own fails with its body: KeyError: 'accelerometer' \(.*line"
    ):
        SimulatedWorld.driver_options(KIND)


def test_the_shipped_robots_are_right() -> None:
    for kind in (SCOUT, "resource_pool.robots.rover.body:Rover", "resource_pool.robots.walker.body:Walker"):
        require_robot(kind)
