"""Schedules, components and whole views that the tests of the consoles share."""

from __future__ import annotations

import msgspec

from backbone.component.messages import ComponentState, LifeState, Parameters, Statistics, StoryEvent
from backbone.creator.messages import HostLoad, ProcessFell
from backbone.nameserver.messages import Components, Disappeared
from backbone.rc_manager.messages import Leases
from backbone.scheduling.requests import Holder, Lease, RequestState
from backbone.scheduling.views import RcView, RequestView, Schedule
from resource_pool.arc_client import StopState, Suspended
from ui_console.model.console import ConsoleModel
from ui_console.model.events import (
    Asked,
    Attention,
    CommandApplied,
    CommandRefused,
    ConsoleEvent,
    GivenBack,
    Granted,
    Heard,
    LinkHeard,
    PictureSeen,
)

GRANT = Granted(
    10.0, "scout1", {"scout": "scout1", "command_radio": "radio"}, {"scout1": 7, "radio": 3}, 15.0, 9.95, False
)
ASK = Asked(9.95, "scout1", "capture", 100)


def request(
    arc: str,
    owner: str,
    state: RequestState,
    *,
    since_s: float = 5.0,
    until_s: float = -1.0,
    expected_s: float = -1.0,
    priority: str = "iros2001:10/surveillance:5/watch1:3",
) -> RequestView:
    because = f"{arc} {state}: its turn"
    return RequestView(
        arc, owner, state, ["scout1"], since_s, until_s, expected_s, because, [], 5.0, priority, 4, "5", "it ends"
    )


def rc(
    name: str, kind: str, holders: list[Holder], following: list[str] | None = None, *, sharable: bool = False
) -> RcView:
    following = following or []
    until_s = [10.0] * len(holders)
    starts_s = [12.0] * len(following)
    return RcView(name, kind, "up", sharable, 1.0, holders, 6, following, until_s, starts_s, is_robot=kind == "scout")


SCHEDULE = Schedule(
    8.0,
    [
        rc("scout2", "scout", []),
        rc("scout1", "scout", [Holder("watch1-capture", 6, 5.0, 10.0)], ["console-1-capture"]),
        rc("radio", "command_radio", [], sharable=True),
        rc("video1", "video_frequency", [Holder("watch1-capture", 9, 5.0, 10.0)], ["console-1-capture"]),
    ],
    [
        request("watch1-capture", "mission_control/watch1", RequestState.RUNNING, until_s=10.0),
        request(
            "console-1-capture",
            "ui_console/console-1",
            RequestState.WAITING,
            expected_s=12.0,
            priority="console-1:100",
        ),
    ],
    [],
)
LEASES = Leases([Lease("scout1", "watch1-capture", 6), Lease("video1", "watch1-capture", 9)], 2.0)


def component(
    address: str,
    kind: str,
    *,
    state: LifeState = LifeState.READY,
    since_s: float = 1.0,
    feedback: str = "",
    requester: str = "backbone/launcher",
    pid: int = 100,
) -> ComponentState:
    return ComponentState(address, kind, "base", pid, state, since_s, feedback, requester, is_robot=kind == "scout")


COMPONENTS = [
    component("backbone/rc_manager", "rc_manager", feedback="1 of 2 ARCs run"),
    component("resource_pool/scout1", "scout", feedback="held by watch1-capture"),
    component("resource_pool/scout2", "scout", feedback="free"),
    component("mission_control/surveillance", "surveillance"),
    component(
        "mission_control/watch1",
        "watch_for_motion",
        feedback="holds scout scout1",
        requester="mission_control/surveillance",
    ),
    component(
        "mission_control/watch2",
        "watch_for_motion",
        feedback="suspended: slice by watch1",
        requester="mission_control/surveillance",
    ),
]
TEAM_EVENTS: list[ConsoleEvent] = [
    Heard(7.0, Components(COMPONENTS, True, 0.0)),
    Heard(8.0, SCHEDULE),
    Heard(8.1, LEASES),
    Heard(8.2, HostLoad("base", [], 0.42, 0.31, 2, 9)),
    LinkHeard(8.2, True, 0.0012),
    Heard(8.3, Statistics({"packets_sent": 120.0, "overruns": 0.0, "worst_packet_s": 0.0021}), "resource_pool/radio"),
    Heard(8.4, StoryEvent(8.4, "mission_control/watch1", "saw motion", "scout1", "")),
    Heard(8.5, Parameters({"threshold": 20, "weight": 0.1}), "mission_control/watch1"),
]
STOP = StopState("scout1", True, 1, "anna", "child in the room", 11.0)


def model(*events: ConsoleEvent, name: str = "console-1") -> ConsoleModel:
    """Return a model that heard these events."""
    made = ConsoleModel(name, user="anna")
    made.team.picture.mission = "iros2001"
    for event in events:
        made.apply(event)
    return made


def held_model() -> ConsoleModel:
    """Return one that holds scout1, with pictures, in the mission above."""
    holding = Schedule(
        10.0,
        [
            rc("scout1", "scout", [Holder("console-1-capture", 7, 10.0, 12.0)], ["watch1-capture"]),
            rc("scout2", "scout", []),
            rc("video1", "video_frequency", [Holder("console-1-capture", 10, 10.0, 12.0)], ["watch1-capture"]),
        ],
        [
            request(
                "console-1-capture",
                "ui_console/console-1",
                RequestState.RUNNING,
                until_s=15.0,
                priority="console-1:100",
            ),
            request("watch1-capture", "mission_control/watch1", RequestState.WAITING, since_s=10.0, expected_s=15.0),
        ],
        [],
    )
    pictures = [PictureSeen(10.5 + 0.1 * n, 10.45 + 0.1 * n, "scout1") for n in range(15)]
    return model(*TEAM_EVENTS, ASK, GRANT, Heard(10.0, holding), *pictures)


EVENTS: list[ConsoleEvent] = [
    *TEAM_EVENTS,
    ASK,
    GRANT,
    Heard(12.0, Suspended("arc", "higher", "console-2", -1.0)),
    GivenBack(13.0, "released", False),
    PictureSeen(11.0, 10.9, "scout1"),
    CommandApplied(11.0, "scout1", 7, "drive", {"left_rad_s": 4.0}, 0.01),
    CommandRefused(11.0, "a.b", "no", "later"),
    Attention(11.0, False),
    Attention(12.0, True),
    LinkHeard(12.0, False),
    Heard(12.0, STOP),
    Heard(12.0, Disappeared("resource_pool/scout1")),
    Heard(12.0, Disappeared("mission_control/watch1")),
    *[Heard(12.5, state) for state in COMPONENTS],
    Heard(12.0, ProcessFell("scout1", "signal 9", -1.0, [])),
    Heard(12.0, msgspec.structs.replace(LEASES, missing=["radio"])),
]
