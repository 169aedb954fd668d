"""What another kind of robot costs: the lines of its folder, and not one line in the code anywhere else."""

from __future__ import annotations

import pytest
from port_of import Port

ROVER = Port(
    "rover",
    "mixed.xml",
    most_lines={"rc.py": 100, "arcs.py": 35},  # chosen: what is written for RC and ARCs in a morning, with docstrings
)
WALKER = Port(
    "walker",
    "walker.xml",
    exceptions={"pyproject.toml": "the extra that installs mink, and the contract that only its kinematics know mink"},
    most_lines={"rc.py": 190, "arcs.py": 35, "pace.py": 60},  # chosen: an RC with a loop of its own, in two mornings
)
each_port = pytest.mark.parametrize("port", [ROVER, WALKER], ids=lambda port: port.robot)


@each_port
def test_no_file_but_its_own_names_the_robot(port: Port) -> None:
    port.assert_named_nowhere_else()


def test_the_search_finds_the_rover() -> None:
    ROVER.assert_search_finds(("my_rover", "SimRover", "ROVER1", "rovers"), ("controversy",))


def test_the_search_finds_the_walker() -> None:
    WALKER.assert_search_finds(("my_walker", "SimWalker", "WALKER1", "walkers"), ("dogwalker",))


@each_port
def test_lines_of_the_port(port: Port, capsys: pytest.CaptureFixture[str]) -> None:
    said = port.assert_few_lines()
    with capsys.disabled():
        print(f"\n{said}")
