"""The law of stops: a stopped robot never moves before an entitled operator lifts the stop and a fresh press drives it.

Three operators, one robot, everything that their consoles decide by, and a network that delays what it likes.
"""

from __future__ import annotations

import heapq
import itertools
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import assert_never

from resource_pool.arc_client import EmergencyStopped, StopState
from resource_pool.stop_knowledge import StopKnowledge
from resource_pool.stop_latch import StopLatch
from resource_pool.stop_messages import OtherStop
from ui_console.model.consent import ConsentDesk, Sought, Topic
from ui_console.model.driving import STICK_LASTS_S, DeadMan, MoveWish
from ui_console.model.lifting import AskFirst, LiftNow, NotThatStop, decide_lift

SEQUENCES, STEPS = 1000, 50
TICK_S = 0.05  # keys repeat that often
LONGEST_DELAY_S = 0.6
CUT_S = 1.5
OFTEN = {"press": 6, "let go": 6, "lift": 4, "answer": 4, "double press": 2, "take": 2}
SELDOM = {"stop": 1, "double stop": 1, "cut": 1, "reconnect": 1, "release": 1}
DOES = [what for what, times in {**OFTEN, **SELDOM}.items() for _time in range(times)]


@dataclass
class Operator:
    """One person, and all that their console decides by."""

    name: str
    uses_stick: bool
    hand: DeadMan = field(default_factory=DeadMan)
    known: StopKnowledge = field(default_factory=StopKnowledge)
    desk: ConsentDesk = field(init=False)
    pressed_s: float | None = None
    epoch: int = 0  # of the grant that this console knows of; 0: none
    is_cut: bool = False
    seen: StopState | None = None

    def __post_init__(self) -> None:
        self.desk = ConsentDesk(self.name)

    @property
    def console(self) -> str:
        return f"ui_console/{self.name}"

    def hear_stop(self, state: StopState) -> None:
        if self.known.heard(state):
            self.seen = state
            self.hand.require_let_go()

    def hear_grant(self, epoch: int) -> None:
        if epoch > self.epoch:
            self.epoch = epoch
            self.hand.require_let_go()

    def hear_loss(self, epoch: int) -> None:
        if epoch >= self.epoch:
            self.epoch = 0
            self.hand.require_let_go()


class World:
    """A robot, its RC, and messages on their way."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)
        self.now_s = 0.0
        self.latch = StopLatch("scout1")
        self.epoch, self.holder = 0, ""
        self.people = [Operator(name, uses_stick=name == "cleo") for name in ("anna", "ben", "cleo")]
        self.answers: dict[tuple[str, int], set[str]] = {}
        self.stopped_by: set[str] = set()
        self.lifted_s = -1.0
        self.moves = self.moves_again = self.lifts = 0
        self._on_the_way: list[tuple[float, int, Callable[[], None]]] = []
        self._numbers = itertools.count()

    def send(self, who: Operator, act: Callable[[], None]) -> None:
        """Let the message arrive later, much later over a cut link."""
        delay_s = self.rng.uniform(0, LONGEST_DELAY_S) + (self.rng.uniform(0, CUT_S) if who.is_cut else 0.0)
        heapq.heappush(self._on_the_way, (self.now_s + delay_s, next(self._numbers), act))

    def pass_s(self, seconds: float) -> None:
        """Let time pass: held controls repeat, consoles send due commands, messages arrive."""
        until_s = self.now_s + seconds
        while self.now_s < until_s:
            self.now_s += TICK_S
            while self._on_the_way and self._on_the_way[0][0] <= self.now_s:
                heapq.heappop(self._on_the_way)[2]()
            for who in self.people:
                if who.pressed_s is not None:
                    drive = MoveWish(who.pressed_s, 1.0)
                    who.hand.press(drive, self.now_s, STICK_LASTS_S if who.uses_stick else None)
                wanted = who.hand.due(self.now_s)
                if isinstance(wanted, MoveWish) and who.epoch:
                    self._command(who, wanted, who.epoch, who.known.number("scout1"))

    def tell_all(self, tell: Callable[[Operator], None]) -> None:
        for who in self.people:
            if self.rng.random() < 0.8:  # publications may get lost
                self.send(who, lambda who=who: tell(who))

    def _command(self, who: Operator, drive: MoveWish, epoch: int, after_stop: int) -> None:
        def arrive() -> None:
            if epoch != self.epoch or who.name != self.holder:
                return
            try:
                self.latch.require_moving(after_stop)
            except EmergencyStopped as stopped:
                refusal = stopped
                self.send(who, lambda: self._refused(who, refusal))
            else:
                self._moved(drive)

        self.send(who, arrive)

    def _refused(self, who: Operator, refusal: EmergencyStopped) -> None:
        who.known.refused(refusal)
        who.hand.require_let_go()

    def _moved(self, drive: MoveWish) -> None:
        pressed_s = drive.forward_m_s
        self.moves += 1
        self.moves_again += self.lifts > 0
        assert not self.latch.state.is_stopped
        assert pressed_s > self.lifted_s, f"pressed at {pressed_s}, lifted at {self.lifted_s}, moved at {self.now_s}"

    def stop(self, who: Operator) -> None:
        def arrive() -> None:
            self.latch.stop(who.name, "", self.now_s, who.console)
            self.stopped_by.add(who.name)
            state = self.latch.state
            self.tell_all(lambda one: one.hear_stop(state))

        who.hand.require_let_go()
        self.send(who, arrive)

    def lift(self, who: Operator) -> None:
        seen = who.seen
        if seen is None:
            return
        match decide_lift(self.latch.state, seen.number, who.name, who.console):
            case NotThatStop():
                return
            case LiftNow():
                self.send(who, lambda: self._lift(who, seen.number))
            case AskFirst(authors):
                for author in authors:
                    other = next(one for one in self.people if one.name == author.by)
                    self.send(who, lambda other=other: self._ask(who, other, seen.number, len(authors)))
            case decision:
                assert_never(decision)

    def _ask(self, who: Operator, other: Operator, number: int, most: int) -> None:
        asked = (who.console, Topic.LIFT)
        if asked not in [(one.asker, one.topic) for one in other.desk.open]:
            why = f"{number} {most}"
            other.desk.open_question(Sought(who.console, who.name, "scout1", why, self.now_s + 8.0, Topic.LIFT))

    def answer(self, who: Operator) -> None:
        """Answer the question that is shown, if any."""
        who.desk.expire(self.now_s)
        for settled in who.desk.decide(self.rng.random() < 0.7):
            if settled.consent.is_given:
                self.send(who, partial(self._agreed, settled.sought, who.name))

    def _agreed(self, sought: Sought, author: str) -> None:
        asker = next(one for one in self.people if one.console == sought.asker)
        number, most = map(int, sought.why.split())
        yes = self.answers.setdefault((asker.name, number), set())
        yes.add(author)
        if len(yes) == most:
            self.send(asker, lambda: self._lift(asker, number))

    def _lift(self, who: Operator, number: int) -> None:
        try:
            is_new = self.latch.lift(number, who.name, self.now_s)
        except OtherStop:
            return
        if is_new:
            asked = self.answers.get((who.name, number), set())
            assert self.stopped_by <= {who.name} | asked, f"{who.name} lifts the stop of {self.stopped_by}"
            self.stopped_by, self.lifted_s = set(), self.now_s
            self.lifts += 1
        state = self.latch.state
        self.tell_all(lambda one: one.hear_stop(state))

    def take(self, who: Operator) -> None:
        self._hand_over(who.name)
        epoch, state = self.epoch, self.latch.state

        def granted() -> None:  # a console asks how the robot is before its grant counts
            who.hear_stop(state)
            who.hear_grant(epoch)

        self.send(who, granted)

    def release(self, who: Operator) -> None:
        if self.holder == who.name:
            self._hand_over("")

    def _hand_over(self, name: str) -> None:
        former, self.holder, self.epoch = self.holder, name, self.epoch + 1
        for one in self.people:
            if one.name == former:
                self.send(one, lambda one=one, epoch=self.epoch - 1: one.hear_loss(epoch))

    def do(self, who: Operator, what: str) -> None:
        match what:
            case "press":
                who.pressed_s = who.pressed_s or self.now_s
            case "let go":
                self._let_go(who)
            case "double press":
                who.pressed_s = who.pressed_s or self.now_s
                self.pass_s(TICK_S)
                self._let_go(who)
                self.pass_s(self.rng.choice([TICK_S, 0.6]))
                who.pressed_s = self.now_s
            case "stop":
                self.stop(who)
            case "double stop":
                self.stop(who)
                self.pass_s(self.rng.uniform(0, 0.6))
                self.stop(who)
            case "lift":
                self.lift(who)
            case "answer":
                self.answer(who)
            case "cut":
                who.is_cut = True
            case "reconnect":
                who.is_cut = False
                who.hand.require_let_go()
            case "take":
                self.take(who)
            case "release":
                self.release(who)

    def _let_go(self, who: Operator) -> None:
        who.pressed_s = None
        if who.uses_stick:
            who.hand.stop()


def play(seed: int) -> World:
    world = World(seed)
    world.take(world.rng.choice(world.people))
    for _step in range(STEPS):
        world.do(world.rng.choice(world.people), world.rng.choice(DOES))
        world.pass_s(world.rng.choice([TICK_S, 0.3, 1.0]))
    return world


def test_a_stopped_robot_moves_only_after_a_lift_by_somebody_entitled_and_a_fresh_press() -> None:
    worlds = [play(seed) for seed in range(SEQUENCES)]
    lifted = sum(world.lifts > 0 for world in worlds)
    moved = sum(world.moves > 0 for world in worlds)
    moved_again = sum(world.moves_again > 0 for world in worlds)
    assert lifted > 300, "or nothing was tried"
    assert moved > 300
    assert moved_again > 100
