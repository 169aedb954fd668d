"""Faults that a change could put into the scheduling core: each at one place, each caught by the tests."""

from __future__ import annotations

from typing import NamedTuple

ROOM = "backbone/scheduling"


class Planted(NamedTuple):
    """One fault.

    Attributes:
        name: What is wrong then.
        file: Below ``ROOM``.
        right: As it stands in the file, once.
        wrong: What stands there instead.
    """

    name: str
    file: str
    right: str
    wrong: str


LAST = "        arc.stamp, arc.raised = self.stamp(), 0\n"

FAULTS = [
    Planted(
        "the youngest goes first",
        "fairness.py",
        "(False, 0.0, *arc.stamp)",
        "(False, 0.0, -arc.stamp[0], -arc.stamp[1])",
    ),
    Planted(
        "an aborted slice costs its place",
        "transitions.py",
        f"        if arc.served(self.decision.now_s):\n    {LAST}        arc.swapped_out",
        f"{LAST}        arc.swapped_out",
    ),
    Planted(
        "a served ARC keeps its place",
        "transitions.py",
        f"        if arc.served(self.decision.now_s):\n    {LAST}        arc.swapped_out",
        "        arc.swapped_out",
    ),
    Planted("an epoch is given twice", "switch.py", "rcs[rc].epoch += 1", "rcs[rc].epoch += 0"),
    Planted(
        "an RC that comes back forgets epochs",
        "state.py",
        "rc.epoch = max(rc.epoch, last_epoch)",
        "rc.epoch = last_epoch",
    ),
    Planted(
        "a reservation lasts after the connection",
        "switch.py",
        "        arc.reservation = None\n        arc.began_s",
        "        arc.began_s",
    ),
    Planted(
        "a new slice keeps its old place",
        "transitions.py",
        f"{LAST}        arc.slice_s",
        "        arc.slice_s",
    ),
    Planted(
        "leases are not renewed when ranks change",
        "switch.py",
        "            self._decision.instructions.append(RenewLeases())",
        "            pass",
    ),
    Planted(
        "ranks count lower holders",
        "switch.py",
        "higher(other.path, arc.path) for",
        "higher(arc.path, other.path) for",
    ),
    Planted("an overridden ARC has time to stop", "transitions.py", 'if why == "slice" and not', "if not"),
    Planted(
        "those that stay begin no new slice",
        "closing.py",
        "                    self._transitions.renew(arc)\n                    renewed = True\n",
        "                    pass\n",
    ),
    Planted(
        "a new slice lets a turn be forgotten",
        "schedule_manager.py",
        "                continue  # slices that began anew changed the plan\n",
        "                break\n",
    ),
    Planted("a revoked ARC hears no expected time", "closing.py", "        self._expect()\n", ""),
    Planted(
        "who is overridden goes before whose slice is over",
        "planner.py",
        "key=turn.arc.goes_before)",
        "key=lambda holder: not turn.arc.goes_before(holder))",
    ),
    Planted("nothing is reserved for an ARC that overrides", "switch.py", "if forced or not", "if not"),
    Planted(
        "an ARC that could not open is not asked again",
        "schedule_manager.py",
        "            self._arcs.retry()\n",
        "            pass\n",
    ),
    Planted("slack eats a short slice", "plan.py", "min(self._slack_s, arc.minimum_s / 2)", "self._slack_s"),
    Planted(
        "slack eats a short slice in a large group",
        "first_in_line.py",
        "min(self._slack_s, arc.minimum_s / 2)",
        "self._slack_s",
    ),
    Planted(
        "a lower ARC overlaps what a higher one reserved",
        "plan.py",
        "if other.level is not arc.level and rank_of(other, arc) > 0:",
        "if False:",
    ),
    Planted(
        "an ARC whose RC is down has a start",
        "plan.py",
        "        if not table.usable(arc):\n            return math.inf\n",
        "",
    ),
    Planted(
        "a higher holder stands only until now", "table.py", "return math.inf if before > 0 else now_s", "return now_s"
    ),
    Planted(
        "a slice counts before its grant", "table.py", "max(now_s + SOON_S, holder.began_s + holder.length_s)", "now_s"
    ),
    Planted(
        "pending starts are left out",
        "preemption.py",
        "[p for p in pending if p.touches & arc.touches]",
        "[p for p in pending if False]",
    ),
    Planted(
        "the ARC granted last goes first",
        "preemption.py",
        "(-holder.granted_s, -holder.stamp[0], -holder.stamp[1])",
        "(holder.granted_s, *holder.stamp)",
    ),
    Planted(
        "a reservation gives no precedence",
        "table.py",
        "            ordered.insert(0, arc)",
        "            ordered.append(arc)",
    ),
    Planted(
        "strict looks at lower ARCs",
        "preemption.py",
        "and other.goes_before(arc) and table.usable(other)\n        for",
        "and arc.goes_before(other) and table.usable(other)\n        for",
    ),
    Planted(
        "aging never comes down",
        "priority_events.py",
        "                self._state.raise_to(arc, 0)",
        "                pass",
    ),
    Planted(
        "a child goes before its parent",
        "priority.py",
        "return (len(a) < len(b)) - (len(a) > len(b))",
        "return (len(a) > len(b)) - (len(a) < len(b))",
    ),
    Planted(
        "holders keep an RC that is down",
        "rc_events.py",
        '                self._transitions.revoke(arc, "rc", name)',
        "                pass",
    ),
    Planted(
        "a lowered capacity revokes nobody",
        "rc_events.py",
        '            self._transitions.revoke(holder, "capacity", name)',
        "            pass",
    ),
    Planted(
        "an RC that forgot its holders is trusted",
        "rc_events.py",
        "            self.went_down(name)  #",
        "            pass  #",
    ),
    Planted("an extension has no end", "arc_events.py", "min(until_s, arc.slice_s + arc.maximum_s)", "until_s"),
    Planted(
        "an idle ARC waits again once free",
        "arc_events.py",
        "                self._state.set_afterwards(arc, Afterwards.IDLE)",
        "                pass",
    ),
    Planted("a successor is forgotten", "arc_events.py", "            self.requested(successor)", "            pass"),
    Planted(
        "new demand is not looked at",
        "state.py",
        "                self.roomy.pop(rc, None)  #",
        "                pass  #",
    ),
    Planted(
        "blocking is not counted",
        "response_time.py",
        "        blockings[place] = longest_us - 1",
        "        blockings[place] = 0",
    ),
    Planted(
        "slices end off the grid",
        "rules.py",
        "self.grid_s if self.grid_s else end_s",
        "self.grid_s if not self.grid_s else end_s",
    ),
    Planted(
        "the first in line of a large group is overtaken",
        "first_in_line.py",
        "        if arc not in firsts:\n",
        "        if False:\n",
    ),
    Planted(
        "two equals of a large group, each first where both want to be, wait for each other",
        "first_in_line.py",
        "ahead.isdisjoint(one.uses)",
        "True",
    ),
    Planted(
        "RCs freed by force in a large group stay free although a higher ARC needs one of them first",
        "first_in_line.py",
        "if arc.reservation is None or one[1]]",
        "if arc.reservation is None]",
    ),
    Planted(
        "a reservation in a large group is kept although an RC on which it depends has changed",
        "first_in_line.py",
        "if rcs & changed:",
        "if False:",
    ),
    Planted(
        "a reservation in a large group is kept after the time from which it would be later",
        "first_in_line.py",
        "self._looked_s > known.until_s",
        "False",
    ),
    Planted(
        "a reservation that depends on who waits is kept for all",
        "first_in_line.py",
        "if not rcs & behind.ahead:",
        "if True:",
    ),
    Planted(
        "an ARC makes way again and again",
        "first_in_line.py",
        "if arc.made_way < 2:",
        "if True:",
    ),
    Planted(
        "a new first in line concerns no other",
        "large_group.py",
        "if joined and self._firsts.is_first_without(rc, joined):",
        "if joined:",
    ),
    Planted(
        "an ARC of a large group counts as blocked although its blocker has changed",
        "large_group.py",
        "and known.version == versions.get(known.rc, 0) + service_version",
        "and True",
    ),
    Planted(
        "an ARC of a large group counts as blocked although its blocker's slice is over",
        "large_group.py",
        "and soon_s < known.until_s",
        "and True",
    ),
    Planted(
        "a pair on a radio counts as another pair with other priorities",
        "compatibility.py",
        "one.level, other.level, one.name < other.name",
        "one.name < other.name",
    ),
    Planted(
        "a slice ends although it is awaited by none",
        "slice_ends.py",
        "wanted = stands and self._is_waited_for(arc)",
        "wanted = stands",
    ),
    Planted(
        "an ARC is connected beside packets that take longer than declared",
        "schedule_manager.py",
        "elif not (self._arcs.understating and self._arcs.ask_anew_beside(turn.arc)):",
        "else:",
    ),
    Planted(
        "holders whose packets are late together all stay",
        "schedule_manager.py",
        "            self._arcs.ask_anew_where_late()\n",
        "            pass\n",
    ),
    Planted(
        "more holders ask anew than must",
        "preemption.py",
        "        if table.state.compatibility.serves_measured(rc, kept):\n            break\n",
        "",
    ),
    Planted(
        "what was measured counts no more after the slice",
        "arc_events.py",
        "        elif waits and arc.understates:\n            self._ask_anew(arc)\n",
        "",
    ),
    Planted(
        "the last measurement counts, not the longest",
        "packet_times.py",
        "known.get((rc, kind), 0.0) < packet_time_s",
        "0.0 < packet_time_s",
    ),
    Planted(
        "an ARC inherits what was measured of one of its name",
        "arc_events.py",
        "        self._packet_times.forget(name)\n",
        "",
    ),
]
