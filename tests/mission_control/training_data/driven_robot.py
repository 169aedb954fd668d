"""Recordings of a robot that is held and driven, made for tests."""

from __future__ import annotations

from collections.abc import Sequence

from small_recordings import SCOUT, Said

from backbone.addresses import RC_MANAGER
from backbone.component.messages import ComponentState, LifeState
from backbone.keys import Conversation
from backbone.rc_manager.messages import Connect, Connected, Disconnect, Disconnected, RcState
from backbone.scheduling.requests import Holder, RcUse, RequestState
from backbone.scheduling.views import RcView, RequestView, Schedule
from resource_pool.messages import Applied, Frame, Readings

CONSOLE, WATCHER, GRABBER = "ui_console/console-1", "mission_control/watch", "resource_pool/grabber"
ARCS = {"watch-capture": WATCHER, "console-1-drive": CONSOLE}
WIDTH_PX, HEIGHT_PX = 4, 2


def known(at_s: float, *holders: Holder) -> list[Said]:
    """Return messages that name the owners of the ARCs: a schedule with the robot's holders, and anna's console."""
    requests = [
        RequestView(arc, owner, RequestState.WAITING, ["scout1"], 0.0, -1.0, -1.0, "", [], 5.0, "night:1", 0)
        for arc, owner in ARCS.items()
    ]
    robot = RcView("scout1", "scout", "up", False, 1.0, list(holders), 0, [], is_robot=True)
    state = ComponentState(CONSOLE, "console", "base", 1, LifeState.READY, 0.0, user="anna")
    return [
        Said(at_s, CONSOLE, Conversation.STATUS, state, CONSOLE),
        Said(at_s, RC_MANAGER, Conversation.SCHEDULE, Schedule(at_s, [robot], requests, []), RC_MANAGER),
    ]


def connected(at_s: float, arc: str, epoch: int) -> list[Said]:
    return [
        Said(at_s, SCOUT, Conversation.ASK, Connect(arc, epoch, 2.0, RcUse([]), {"scout1": epoch}), RC_MANAGER),
        Said(at_s, SCOUT, Conversation.ASK, Connected(epoch)),
    ]


def disconnected(at_s: float, arc: str, epoch: int) -> list[Said]:
    return [
        Said(at_s, SCOUT, Conversation.ASK, Disconnect(arc, epoch), RC_MANAGER),
        Said(at_s, SCOUT, Conversation.ASK, Disconnected(epoch)),
    ]


def holding(at_s: float, arc: str, epoch: int) -> Said:
    holders = [Holder(arc, epoch, 0.0, at_s + 2.0)] if arc else []
    return Said(at_s, SCOUT, Conversation.TELEMETRY, RcState("scout1", "scout", False, 1.0, holders, epoch, 0, 0))


def moved(at_s: float, epoch: int, forward_m_s: float, turn_rad_s: float) -> Said:
    values = {"left_rad_s": 1.0, "forward_m_s": forward_m_s, "turn_rad_s": turn_rad_s}
    return Said(at_s, SCOUT, Conversation.MOTIONS, Applied("scout1", epoch, at_s, "drive", values, 1))


def halted(at_s: float, epoch: int) -> Said:
    return Said(at_s, SCOUT, Conversation.MOTIONS, Applied("scout1", epoch, at_s, "halt", {}, 1))


def reported(at_s: float, **values: float | bool) -> Said:
    return Said(at_s, SCOUT, Conversation.READINGS, Readings("scout1", at_s, values))


def seen(at_s: float, arc: str, level: int, size_px: Sequence[int] = (WIDTH_PX, HEIGHT_PX), camera: str = "") -> Said:
    pixels = memoryview(bytes([level]) * (size_px[0] * size_px[1]))
    frame = Frame("grabber", arc, 3, "scout1", 1, at_s, *size_px, pixels)
    at = f"resource_pool/{arc}/{camera}" if camera else f"resource_pool/{arc}"
    return Said(at_s, at, Conversation.FRAMES, frame, GRABBER)
