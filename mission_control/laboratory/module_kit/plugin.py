"""The pytest plugin ``scout_backbone``: fixtures that try modules, graphs and missions.

pytest loads this file wherever scout-backbone is installed, so nothing else is imported until a test uses a fixture.
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
    """Give ``module_under_test(module)``, the module, fed by hand and held to the rules of modules.

    Each update checks that inputs and outputs are of the declared classes, that messages can cross the bus, and that
    neither an input nor an output of the update before was changed. A breach raises ``ModuleRuleBroken``.

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
    """Give ``module_graph(*modules, given=…, frequency_hz=…)``, the modules, connected and run on virtual time.

    Connections are checked as in a mission, and each module is held to the rules, as by ``module_under_test``.

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
    """Give ``virtual_mission(mission, scene)``, which plays a whole mission in this process, on virtual time.

    The mission is a file's path, or the file's text. Nameserver, databases, RC manager and every component of the file
    are the real ones, on the local bus; the placer and its creators are played. The scene is a coroutine function that
    gets the running mission; its result is returned. A component that falls fails the test.

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
    """Give ``real_mission(mission, *options)``, a context manager: a mission of real processes over Zenoh.

    The mission is a file's path, or the file's text; the options are those of ``scout-backbone up``. It has a name and
    a runtime folder of its own, in which its hub listens, so it meets no other mission and no port that is taken. At
    the end it is taken down, and a process that is left fails the test. If the test fails, the ends of all logs are
    printed with the failure.

    Example:
        >>> def test_both_modules_run(real_mission):
        ...     with real_mission("pair.xml") as running:
        ...         running.wait_for_components("waves")
    """
    from mission_control.laboratory.module_kit.real_mission import mission_up

    return mission_up
