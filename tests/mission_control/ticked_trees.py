"""The reference: trees of composites that are run by ticks, as BehaviorTree.CPP runs them."""

from __future__ import annotations

from collections import Counter

from composed_trees import FAILURE, LONGEST, RUNNING, SUCCESS, Plan, Result

from mission_control.composites import WhileSuspended
from mission_control.messages import BehaviorStatus


class Tick:
    """A node as BehaviorTree.CPP has it: ``tick`` until it is no longer running, ``halt`` in between."""

    def __init__(self, plan: Plan, runs: Counter[str]) -> None:
        self.plan, self.runs = plan, runs
        self.children = [reference(child, runs) for child in plan.children]
        self.is_running = False
        self.stands_since: int | None = None

    @property
    def is_suspended(self) -> bool:
        running = [child for child in self.children if child.is_running]
        return self.is_running and bool(running) and all(child.is_suspended for child in running)

    def tick(self, now: int) -> BehaviorStatus:
        if not self.is_running:
            self.is_running = True
            self.stands_since = None
            self.runs[self.plan.name] += 1
            self.reset(now)
        status = self.go_on(now)
        if status.is_final:
            self.halt()
        if not self.is_suspended:
            self.stands_since = None
        elif self.stands_since is None:
            self.stands_since = now
        return status

    def is_late(self, child: Tick, now: int) -> bool:
        """Return whether a child has stood still for as long as this parent has patience."""
        since = child.stands_since
        return child.is_running and since is not None and now - since >= self.plan.settings["patience_s"]

    def tick_with_patience(self, child: Tick, now: int) -> BehaviorStatus:
        """Tick the only child that runs; with FAIL, halt it when it is late."""
        status = child.tick(now)
        if self.plan.settings.get("while_suspended") is WhileSuspended.FAIL and self.is_late(child, now):
            child.halt()
            return FAILURE
        return status

    def halt(self) -> None:
        self.is_running = False
        for child in self.children:
            child.halt()

    def reset(self, now: int) -> None: ...
    def go_on(self, now: int) -> BehaviorStatus: ...  # type: ignore[empty-body]


class TickLeaf(Tick):
    def reset(self, now: int) -> None:
        self.left, self.succeeds = self.plan.outcomes[(self.runs[self.plan.name] - 1) % len(self.plan.outcomes)]
        self.began = now

    @property
    def is_suspended(self) -> bool:
        return self.is_running and self.stands

    def go_on(self, now: int) -> BehaviorStatus:
        if now > self.began and not self.stands:
            self.left -= 1
        self.stands = now in self.plan.suspended
        return RUNNING if self.left else SUCCESS if self.succeeds else FAILURE


class TickInOrder(Tick):
    """Sequence and fallback: the next child after this one has ended with ``goes_on``."""

    goes_on, stops = SUCCESS, FAILURE

    def reset(self, now: int) -> None:
        self.at = 0

    def go_on(self, now: int) -> BehaviorStatus:
        while self.at < len(self.children):
            status = self.tick_with_patience(self.children[self.at], now)
            if status is not self.goes_on:
                return status
            self.at += 1
        return self.goes_on


class TickFallback(TickInOrder):
    goes_on, stops = FAILURE, SUCCESS


class TickFallbackNext(Tick):
    """From the first child on at every tick; one that is suspended for too long is passed over."""

    def reset(self, now: int) -> None:
        self.failed, self.since = set[int](), dict[int, int]()

    def go_on(self, now: int) -> BehaviorStatus:
        for place, child in enumerate(self.children):
            if place in self.failed:
                continue
            status = child.tick(now)
            if status is SUCCESS:
                return SUCCESS
            if status is FAILURE:
                self.failed.add(place)
            elif not self._is_unavailable(place, now):
                for later, other in enumerate(self.children[place + 1 :], place + 1):
                    other.halt()
                    self.since.pop(later, None)
                return RUNNING
        return FAILURE if len(self.failed) == len(self.children) else RUNNING

    def _is_unavailable(self, place: int, now: int) -> bool:
        if not self.children[place].is_suspended:
            self.since.pop(place, None)
            return False
        return now - self.since.setdefault(place, now) >= self.plan.settings["patience_s"]


class TickParallel(Tick):
    """All children are ticked before any is judged to be late."""

    def reset(self, now: int) -> None:
        self.results: dict[int, BehaviorStatus] = {}
        self.skipped = set[int]()

    def go_on(self, now: int) -> BehaviorStatus:
        for place, child in enumerate(self.children):
            if place in self.results:
                continue
            status = child.tick(now)
            if status.is_final:
                self.results[place] = status
            if status.is_final or not child.is_suspended:
                self.skipped.discard(place)
            if (result := self.judged()).is_final:
                return result
        open_places = [place for place in range(len(self.children)) if place not in self.results]
        how = self.plan.settings.get("while_suspended", WhileSuspended.WAIT)
        late = [
            place for place in open_places if how is not WhileSuspended.WAIT and self.is_late(self.children[place], now)
        ]
        if how is WhileSuspended.SKIP:
            self.skipped |= {*late}
            return self.judged()
        for place in late:
            self.children[place].halt()
            self.results[place] = FAILURE
            if (result := self.judged()).is_final:
                return result
        return RUNNING

    def judged(self) -> BehaviorStatus:
        count = len(self.children) - len(self.skipped)
        needed, too_many = (
            given if given >= 0 else max(count + given + 1, min(count, 1))
            for given in (self.plan.settings["success_count"], self.plan.settings["failure_count"])
        )
        found = Counter(self.results.values())
        if count == 0:
            return RUNNING
        if found[SUCCESS] >= needed:
            return SUCCESS
        if count - found[FAILURE] < needed or found[FAILURE] >= too_many:
            return FAILURE
        return RUNNING


class TickAgain(Tick):
    """Retry and repeat."""

    def reset(self, now: int) -> None:
        self.count, self.rests_until = 0, now

    def go_on(self, now: int) -> BehaviorStatus:
        again = FAILURE if self.plan.kind == "retry" else SUCCESS
        while now >= self.rests_until:
            status = self.tick_with_patience(self.children[0], now)
            if status is not again:
                return status
            self.count += 1
            if self.count == self.plan.settings["most"]:
                return status
            self.rests_until = now + self.plan.settings["pause_s"]
        return RUNNING


class TickTimeout(Tick):
    def reset(self, now: int) -> None:
        self.used = -1

    def go_on(self, now: int) -> BehaviorStatus:
        stands = self.children[0].is_suspended and self.plan.settings["while_suspended"] is WhileSuspended.WAIT
        self.used += not stands
        status = self.children[0].tick(now)
        return FAILURE if status is RUNNING and self.used >= self.plan.settings["seconds"] else status


class TickWait(Tick):
    def reset(self, now: int) -> None:
        self.until = now + self.plan.settings["seconds"]

    def go_on(self, now: int) -> BehaviorStatus:
        return SUCCESS if now >= self.until else RUNNING


def reference(plan: Plan, runs: Counter[str]) -> Tick:
    kinds: dict[str, type[Tick]] = {
        "leaf": TickLeaf,
        "sequence": TickInOrder,
        "fallback": TickFallback,
        "parallel": TickParallel,
        "retry": TickAgain,
        "repeat": TickAgain,
        "timeout": TickTimeout,
        "wait": TickWait,
    }
    if plan.settings.get("while_suspended") is WhileSuspended.NEXT:
        return TickFallbackNext(plan, runs)
    return kinds[plan.kind](plan, runs)


def by_ticks(plan: Plan) -> tuple[Result, Counter[str]]:
    """Return the result of the reference, and how often it started each node."""
    runs = Counter[str]()
    root = reference(plan, runs)
    for now in range(LONGEST + 1):
        status = root.tick(now)
        if status.is_final:
            return (status, now), runs
    return None, runs
