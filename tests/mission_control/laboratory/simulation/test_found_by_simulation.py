"""Missions that once broke a law, each with the few faults that were enough for it."""

from __future__ import annotations

from functools import cache

import pytest
from examples import some

from mission_control.laboratory.simulation.faults import Fault, KillFault, MessageFault
from mission_control.laboratory.simulation.mission_run import MissionRun, run_mission
from mission_control.laboratory.simulation.supervised_mission import run_supervised
from mission_control.laboratory.simulation.supervision_faults import Cut, End, Pause, Starve, SupervisionFault

FOUND: dict[str, tuple[int, list[Fault]]] = {
    "an RC whose renewal came too late lets go, and the RC manager must hear of it": (
        134,
        [MessageFault("backbone/rc_manager > resource_pool/radio1 Leases 16", "late", 2.437)],
    ),
    "an RC whose return was not heard of is there all the same": (
        136,
        [
            MessageFault("backbone/nameserver > backbone/rc_manager Appeared 4", "lost"),
            KillFault(3.712, "video2", 1.397),
            KillFault(5.064, "console1-drive", 0.69),
            KillFault(6.786, "radio1", 0.597),
        ],
    ),
    "an order to open that comes twice does not shut the gate": (
        18,
        [
            MessageFault("backbone/rc_manager > resource_pool/behavior6-capture OpenGate 1", "doubled"),
            MessageFault("resource_pool/scout4 > resource_pool/radio1 LoadPacket 2", "late", 1.09),
        ],
    ),
    "a connection that is undone is not renewed meanwhile": (
        76,
        [
            MessageFault("resource_pool/behavior4-drive > backbone/rc_manager answer GateOpens 1", "lost"),
            MessageFault("backbone/rc_manager > resource_pool/radio1 Disconnect 2", "lost"),
        ],
    ),
    "a request that was lost is asked for when its ARC beats": (
        9,
        [MessageFault("resource_pool/behavior2-video_drive > backbone/rc_manager SchedulingRequest 1", "lost")],
    ),
    "RCs that are freed late make no turn a forgotten one": (
        1085,
        [MessageFault("resource_pool/console7-drive > backbone/nameserver Register 1", "lost")],
    ),
    "a notice that was lost is told again": (
        282,
        [
            MessageFault("backbone/dependency_database > resource_pool/behavior1-drive answer RcSets 1", "lost"),
            MessageFault("resource_pool/behavior3-capture > mission_control/behavior3 AskBeat 9", "lost"),
            MessageFault("mission_control/behavior1 > resource_pool/behavior1-drive answer Noted 3", "lost"),
            MessageFault("resource_pool/behavior1-drive > mission_control/behavior1 AskBeat 10", "lost"),
            MessageFault("resource_pool/behavior5-drive > mission_control/behavior5 Suspended 2", "lost"),
        ],
    ),
    "an RC a restarted RC manager meets late is freed of its old holders first": (
        1232,
        [
            MessageFault("resource_pool/video2 > backbone/nameserver Register 1", "late", 0.126381),
            MessageFault("backbone/rc_manager > resource_pool/radio1 Leases 10", "late", 0.948966),
            KillFault(4.200287, "rc_manager", 0.326),
        ],
    ),
    "an owner hears the end of its grant also when the order to shut the gate was lost": (
        1286,
        [
            MessageFault("mission_control/behavior4 > resource_pool/behavior4-video_drive answer Noted 21", "lost"),
            MessageFault("mission_control/behavior4 > resource_pool/behavior4-video_drive answer Noted 28", "lost"),
            MessageFault("backbone/rc_manager > resource_pool/behavior4-video_drive CloseGate 2", "lost"),
        ],
    ),
    "an ARC that is taken for the one before it asks anew": (
        1367,
        [
            MessageFault("resource_pool/behavior5-drive > mission_control/behavior5 AskBeat 9", "lost"),
            MessageFault("backbone/nameserver > backbone/rc_manager answer Registered 1", "late", 0.344429),
            MessageFault("backbone/rc_manager > resource_pool/behavior5-drive AskRequest 2", "late", 0.400806),
            KillFault(8.011902, "console2", 1.447),
            KillFault(11.299141, "rc_manager", 0.271),
        ],
    ),
}


@cache
def run_found(what: str) -> MissionRun:
    """Return the mission with its faults, played once for all tests that look at it."""
    seed, faults = FOUND[what]
    return run_mission(seed, chaos=True, faults=faults)


@pytest.mark.parametrize("what", some(FOUND))
def test_what_was_found_does_not_come_back(what: str) -> None:
    run = run_found(what)
    assert run.broken is None, f"{what}: {run.broken}"


def test_these_missions_still_suffer_what_they_were_found_with() -> None:
    """A message has its name from how many went before it; once most names have changed, the cases prove nothing."""
    found = {what: FOUND[what][1] for what in some(FOUND)}
    whole = [set(run_found(what).faults) == set(faults) for what, faults in found.items()]
    assert sum(whole) >= len(whole) / 2


SUPERVISED: dict[str, tuple[int, list[SupervisionFault]]] = {
    "an ARC that is ended from outside at its first start is begun again, and its behavior does not fail": (
        1,
        [End(3.1, "tree1-leaf1", "killed"), End(3.1, "tree1-leaf1-drive", "killed", 0.005)],
    ),
    "a component that runs where nobody reaches it is named as absent": (
        0,
        [Cut(2.7, "behavior1", 19.7), End(3.3, "nameserver", "politely")],
    ),
    "a behavior waits for its ARC while the dependency database is cut off": (
        1761,
        [End(1.341, "creator-h1", "killed"), Cut(1.567, "dependency_database", 10.279)],
    ),
    "a look that waits for a creator that is cut off delays no word about what hangs": (
        612,
        [Pause(2.319, "scout4", 17.5), Cut(3.494, "creator-h2", 1.695)],
    ),
    "a behavior whose first claim is refused while its host comes back does not fail for good": (
        1,
        [Cut(3.1, "h2", 8.0), End(6.0, "tree1-leaf1", "killed")],
    ),
    "an ARC whose gate stayed shut once is not named while it waits for others": (
        7700180,
        [Cut(3.257729, "h2", 25.930718), End(4.776615, "placer", "politely")],
    ),
    "of a process that is killed while it is starved nothing is recorded": (
        7700487,
        [Starve(2.402, "h1", 3.777, 0.3), End(4.953, "creator-h1", "killed")],
    ),
}


@pytest.mark.parametrize("what", some(SUPERVISED))
def test_what_was_found_in_supervised_missions_does_not_come_back(what: str) -> None:
    seed, faults = SUPERVISED[what]
    run = run_supervised(seed, chaos=True, faults=faults)
    assert run.broken is None, f"{what}: {run.broken}"
