"""Robots: the holder of each, the end of its slice, the waiting ARCs, and the stop in force.

Rules of this file: no bus, no clock, no screen; messages go in, views and alarms come out; times are arguments.
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec.structs import replace

from backbone.component.abilities import FieldForm
from backbone.component_database.messages import Types
from backbone.mission_log.people import is_console, screens_of
from backbone.naming import Subsystem, component_of, reading_order
from backbone.picture.mission import MissionPicture
from backbone.picture.words import because
from backbone.rc_manager.messages import Leases
from backbone.scheduling.views import RcView, RequestView, Schedule
from resource_pool.arc_client import Readings, Stopper, StopState
from ui_console.model.alarms import AlarmBook
from ui_console.model.gauges import LOW_BATTERY, battery_of, gauges
from ui_console.model.lifting import author_name, authors, is_own, lift_line
from ui_console.model.link_board import LinkBoard
from ui_console.model.views import LEAVING, NONE_S, AlarmKind, RobotView, StopView


class RobotBoard:
    """State of the robots, from messages.

    Args:
        links: Knows the missing RCs.
        lift_remedy: Remedy for a stop, for an operator of this console.
    """

    def __init__(self, picture: MissionPicture, alarms: AlarmBook, links: LinkBoard, lift_remedy: str) -> None:
        self._picture, self._alarms, self._links, self._lift_remedy = picture, alarms, links, lift_remedy
        self._renewed: dict[tuple[str, str, int], float] = {}
        self._stops: dict[str, StopState] = {}
        self._gone: set[str] = set()
        self._readings: dict[str, Readings] = {}
        self._reports: dict[str, list[FieldForm]] = {}

    def take_schedule(self, schedule: Schedule) -> None:
        """Record the holders: a new hold counts as renewed when it began."""
        self._renewed = {
            (rc.rc, holder.arc, holder.epoch): self._renewed.get((rc.rc, holder.arc, holder.epoch), holder.since_s)
            for rc in schedule.rcs
            for holder in rc.holders
        }

    def take_leases(self, leases: Leases, at_s: float) -> None:
        """Record the holds that were renewed."""
        for lease in leases.leases:
            self._renewed[lease.rc, lease.arc, lease.epoch] = at_s

    def take_stop(self, stop: StopState, at_s: float) -> None:
        """Record that a robot was stopped, or may move again; a message older than the last one changes nothing."""
        former = None if stop.rc in self._gone else self._stops.get(stop.rc)
        self._gone.discard(stop.rc)
        if former is not None and (former.number, not former.is_stopped) > (stop.number, not stop.is_stopped):
            return
        self._stops[stop.rc] = stop
        unsure = "" if stop.is_confirmed else "; the radio did not take it, so the wheels turn for a moment more"
        line = f"{stop.rc} was stopped by {stop.by}{f': {stop.reason}' if stop.reason else ''}{unsure}"
        if stop.is_stopped:
            self._alarms.begin(AlarmKind.STOPPED, stop.rc, line, at_s, self._lift_remedy)
        else:
            self._alarms.retract(AlarmKind.STOPPED, stop.rc)  # the log names who lifted it; nothing is left to do

    def take_gone(self, robot: str) -> None:
        """Record that a robot's RC is gone: the next one may have lost its stops, and count them from the beginning."""
        if robot in self._stops:
            self._gone.add(robot)

    def take_readings(self, readings: Readings, at_s: float) -> None:
        """Record a robot's readings; a low battery raises an alarm until it is charged or the robot is silent."""
        known = self._readings.get(readings.rc)
        if readings.at_s < 0 or (known is not None and known.at_s > readings.at_s):
            return
        self._readings[readings.rc] = readings
        battery = battery_of(readings)
        is_low = battery is not None and battery < LOW_BATTERY
        line = f"the battery of {readings.rc} is low: {battery or 0.0:.0%}"
        self._alarms.hold(is_low, AlarmKind.BATTERY, readings.rc, line, at_s, "Bring it back while it can drive.")

    def take_types(self, types: Types) -> None:
        """Record the report fields that each type of robot declares."""
        kinds = (one.component_type for one in types.types)
        self._reports = {kind.name: kind.abilities.reports for kind in kinds if kind.abilities.reports}

    def views(self, now_s: float) -> list[RobotView]:
        """Return the robots, sorted by name; none is marked as an operator's own, and none has pictures."""
        if self._picture.schedule is None:
            return []
        requests = {request.arc: request for request in self._picture.schedule.requests}
        rcs = sorted((rc for rc in self._picture.schedule.rcs if rc.is_robot), key=lambda rc: reading_order(rc.rc))
        return [self._robot(rc, number, requests, now_s) for number, rc in enumerate(rcs, 1)]

    def names(self) -> list[str]:
        """Return every known robot, from the schedule or from components."""
        schedule, there = self._picture.schedule, self._picture.components.values()
        in_schedule = {rc.rc for rc in (schedule.rcs if schedule else []) if rc.is_robot}
        return sorted(in_schedule | {component_of(one.address) for one in there if one.is_robot}, key=reading_order)

    def stop_of(self, robot: str) -> StopState | None:
        """Return the stop in force on the robot."""
        stop = self._stops.get(robot)
        return stop if stop is not None and stop.is_stopped else None

    def stop_view(self, robot: str, now_s: float, user: str = "", console: str = "") -> StopView | None:
        """Return the stop in force on the robot, as a view.

        Args:
            now_s: Mission time.
            user: The person at the screen; empty: no particular person.
            console: Address of that person's console.
        """
        stop = self.stop_of(robot)
        if stop is None:
            return None
        by_user, *also = dict.fromkeys(map(author_name, authors(stop)))
        return StopView(
            number=stop.number,
            reason=stop.reason,
            age_s=max(0.0, now_s - stop.at_s),
            is_confirmed=stop.is_confirmed,
            by_user=by_user,
            also=also,
            is_mine=is_own(stop, user, console),
            lift_line=lift_line(stop, user, console, self._is_there),
        )

    def _robot(self, rc: RcView, number: int, requests: Mapping[str, RequestView], now_s: float) -> RobotView:
        component = self._picture.components.get(f"{Subsystem.RESOURCE_POOL}/{rc.rc}")
        readings = self._readings.get(rc.rc)
        waiting = [self._picture.people.person(requests[arc].owner) for arc in rc.next if arc in requests]
        free = RobotView(
            rc.rc,
            number,
            rc.state != "down" and not self._links.is_missing(rc.rc),
            waiting,
            self.stop_view(rc.rc, now_s),
            self._picture.people.named(component.feedback) if component is not None else "",
            gauges=gauges(readings, self._reports.get(rc.kind, ())) if readings is not None else [],
            reported_age_s=max(0.0, now_s - readings.at_s) if readings is not None else NONE_S,
        )
        if not rc.holders:
            return free
        holder = rc.holders[0]
        request = requests.get(holder.arc)
        renewed_s = self._renewed.get((rc.rc, holder.arc, holder.epoch), holder.since_s)
        lease_s = self._links.leases.lease_s if self._links.leases is not None else holder.lease_until_s - renewed_s
        age_s = max(0.0, now_s - renewed_s)
        return replace(
            free,
            holder=self._picture.people.person(request.owner if request else holder.arc),
            arc=holder.arc,
            is_console=request is not None and is_console(request.owner),
            priority=self._picture.people.named(request.priority) if request else "",
            epoch=holder.epoch,
            since_s=holder.since_s,
            until_s=request.until_s if request else NONE_S,
            lease_left_s=max(0.0, lease_s - age_s),
            lease_age_s=age_s,
            because=because(request, self._picture.people) if request else "",
        )

    def _is_there(self, author: Stopper) -> bool:
        """Return whether the author of a stop is present; True until a message names the present operators."""
        there = self._picture.components
        at = {author.console, *(screen.address for screen in screens_of(author.by, there.values()))} & there.keys()
        return any(there[one].state not in LEAVING for one in at) or not there
