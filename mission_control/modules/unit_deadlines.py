"""The deadlines of a unit's sources: publishes one event when values are late, and one when they come in time again."""

from __future__ import annotations

from collections.abc import Callable, Collection

from backbone.component.component import Component
from backbone.component.messages import DEADLINES_MISSED, LogLevel
from backbone.component.recurring import CALM_S, Recurring
from backbone.deadlines import Deadlines
from backbone.ranges import LONGEST_MENTION
from mission_control.modules.orders import UnitParameters

LEAST_PAUSE_S = 0.02  # chosen: a person sees no delay, and fifty looks a second cost nothing; seconds of the machine


class UnitDeadlines:
    """Watches the deadlines of one unit; create it when the unit subscribes.

    Args:
        component: Component that runs the unit.
        keys: Keys whose values come from outside the unit.
        changed: Called when ``text`` has changed.
    """

    def __init__(
        self,
        component: Component[UnitParameters],
        keys: Collection[str],
        changed: Callable[[], None],
    ) -> None:
        self._component, self._changed = component, changed
        self._sources, qualities = component.parameters.sources, component.parameters.qualities
        self._within_s = {key: qualities[key].deadline_s for key in keys if key in qualities}
        self._within_s = {key: within_s for key, within_s in self._within_s.items() if within_s}
        self._deadlines = Deadlines(self._within_s, component.clock.now_s())
        self._recurring, self._late_s = Recurring(CALM_S * component.clock.rate), dict[str, float]()

    @property
    def late(self) -> Collection[str]:
        """The keys that are late at present."""
        return self._deadlines.late

    @property
    def text(self) -> str:
        """The keys that are late at present, as text; empty: no key is late."""
        late = [f"no {key} from {self._sources[key].address}" for key in self.late]
        return ", ".join(late)

    def met(self, key: str) -> None:
        """Record the arrival of a value."""
        late_s = self._deadlines.came(key, self._component.clock.now_s())
        if late_s is not None:
            self._late_s[key] = late_s
            self._recurring.goes(key, self._component.clock.now_s())
            self._changed()

    async def watch(self) -> None:
        """Publish an event as soon as a key is late, and when it is in time again; return if there are no deadlines."""
        clock = self._component.clock
        while self._within_s:
            now_s = clock.now_s()
            for key in self._deadlines.newly_missed(now_s):
                if self._recurring.comes(key):
                    told = f"no value from {self._sources[key].address} within {self._within_s[key]:g} s"
                    self._component.publish_event(key, told, LogLevel.WARNING)
                self._changed()
            for key, count in self._recurring.over(now_s).items():
                said = f"comes again, {self._late_s[key]:.3f} s late"
                if count > 1:
                    said = f"comes in time again; it was late {count} times, the last time by {self._late_s[key]:.3f} s"
                self._component.publish_event(key, said, LogLevel.NOTICE)
            pause_s = max(LEAST_PAUSE_S * clock.rate, min(self._within_s.values()))  # for late keys that arrive again
            await clock.sleep_until_s(min(self._deadlines.next_s, self._recurring.next_s, now_s + pause_s))

    def statistics(self) -> dict[str, float]:
        """Return the number of misses of each deadline, by the key on the bus."""
        return {
            f"{DEADLINES_MISSED}{self._sources[key].address}/{self._sources[key].conversation}"[:LONGEST_MENTION]: count
            for key, count in self._deadlines.missed.items()
        }
