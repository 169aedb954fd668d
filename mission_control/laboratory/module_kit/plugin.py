"""The pytest plugin ``scout_backbone``: fixtures to test modules, graphs and missions.

pytest loads this file wherever scout-backbone is installed, so it imports other files only when a test uses a fixture.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from mission_control.laboratory.module_kit.graph_under_test import MakeGraph
    from mission_control.laboratory.module_kit.module_under_test import MakeModule
    from mission_control.laboratory.module_kit.real_mission import BringUp
    from mission_control.laboratory.module_kit.virtual_mission import Play


@pytest.fixture
def module_under_test() -> MakeModule:
    """Provide ``module_under_test(module)``: the module, fed by hand, with checks of the rules of modules.

    Each update checks that inputs and outputs are of the declared classes, that messages can cross the bus, and that
    no input and no output of the last four updates was changed. A violation raises ``ModuleRuleBroken``.

    Example:
        >>> def test_smoothing_takes_its_share(module_under_test):
        ...     smoothing = module_under_test(Smoothing(Smoothing.Parameters(weight=0.5)))
        ...     assert smoothing.update(wave=Height(1.0)) == Smoothing.Outputs(Height(0.5))
        ...     smoothing.check_reset()
    """
    from mission_control.laboratory.module_kit.module_under_test import ModuleUnderTest

    return ModuleUnderTest


@pytest.fixture
def module_graph() -> MakeGraph:
    """Provide ``module_graph(*modules, given=…, frequency_hz=…)``: the modules, connected and run on virtual time.

    Connections are checked as in a mission, and each module is checked as by ``module_under_test``.

    Example:
        >>> def test_waves_are_smoothed(module_graph):
        ...     graph = module_graph(Wave(), Smoothing(), frequency_hz=20.0)
        ...     graph.advance(1.0)
        ...     assert len(graph.made["smooth"]) == 20
    """
    from mission_control.laboratory.module_kit.graph_under_test import GraphUnderTest

    return GraphUnderTest


@pytest.fixture
def virtual_mission() -> Play:
    """Provide ``virtual_mission(mission, scene)``: it runs a whole mission in this process, on virtual time.

    The mission is a file's path, or the file's text. Nameserver, databases, RC manager and every component of the file
    are the real ones, on the local bus; placer and creators are simulated. The scene is a coroutine function that gets
    the running mission; its result is returned. If a component crashes, the test fails.

    Example:
        >>> def test_a_minute_of_waves(virtual_mission):
        ...     async def scene(running):
        ...         await running.clock.sleep_s(60.0)
        ...         return await running.statistics("waves")
        ...
        ...     assert virtual_mission("pair.xml", scene)["missed"] == 0
    """
    from mission_control.laboratory.module_kit.virtual_mission import play

    return play


@pytest.fixture
def real_mission() -> BringUp:
    """Provide ``real_mission(mission, *options)``, a context manager: a mission of real processes over Zenoh.

    The mission is a file's path, or the file's text; the options are those of ``scout-backbone up``. It has its own
    name and its own runtime folder, in which its hub listens, so it conflicts with no other mission and needs no free
    port. At the end the mission is taken down; if a process is left, the test fails. If the test fails, the ends of all
    logs are printed.

    Example:
        >>> def test_both_modules_run(real_mission):
        ...     with real_mission("pair.xml") as running:
        ...         running.wait_for_components("waves")
    """
    from mission_control.laboratory.module_kit.real_mission import mission_up

    return mission_up
