"""OwnReports: the reports of a behavior to its parent, or to the console that ordered it."""

from __future__ import annotations

from backbone.naming import Subsystem, address
from mission_control.behavior_of_parts import BehaviorOfParts
from mission_control.keeper_reports import KeeperReports
from mission_control.messages import BehaviorStatus, ChildReport
from mission_control.parent_reports import ParentReports


class OwnReports:
    """Sends the newest report whenever there is news.

    Attributes:
        keeper: The reports to the console that ordered the behavior; None: the behavior is a node of the mission's
            tree.
    """

    def __init__(self, behavior: BehaviorOfParts) -> None:
        self.keeper: KeeperReports | None = None
        self._behavior = behavior
        self._parent: ParentReports | None = None
        self._told_because = ""
        self._is_wound_up = False

    def connect(self, keeper: str) -> None:
        """Watch the console at this address or, if it is empty, the parent; the first step of a path is none."""
        of = self._behavior
        if keeper:
            self.keeper = KeeperReports(of.bus, of.clock, keeper, self._newest)
        elif len(of.path) > 2:
            parent = address(Subsystem.MISSION_CONTROL, of.path[-2][0])
            self._parent = ParentReports(of.bus, of.clock, parent, self._newest, of.begin_task)

    @property
    def has_reader(self) -> bool:
        """True: a parent or a console gets the reports."""
        return self.keeper is not None or self._parent is not None

    def send(self) -> None:
        """Send a report soon, unless the behavior has finished."""
        reader = self.keeper or self._parent
        if reader is not None and not self._behavior.status.is_final:
            reader.send()

    def begin(self) -> None:
        """Send the first report; it replaces the reports of an earlier process."""
        self._told_because = self._behavior.suspended_because
        self.send()

    def suspension_changed(self) -> None:
        """Send a report if the reason of the suspension has changed."""
        if self._behavior.suspended_because != self._told_because:
            self.begin()

    async def conclude(self) -> None:
        """Send the final status until the parent has acknowledged it; to a console, until it ends the behavior."""
        self._is_wound_up = True
        if self.keeper is not None:
            self.keeper.send()
        elif self._parent is not None:
            await self._parent.conclude()

    def _newest(self) -> ChildReport:
        """Return the newest report; it has the final status only after ARC and children are released."""
        of = self._behavior
        status = of.status if self._is_wound_up else BehaviorStatus.RUNNING
        return ChildReport(of.name, status, of.payload, of.suspended_because)
