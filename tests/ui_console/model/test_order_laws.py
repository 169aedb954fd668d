"""Laws of the order book, among a stick, behaviors that start late, and a scheduler that grants by rank."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import hypothesis.strategies as st
import pytest
from examples import share
from hypothesis import settings
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from ui_console.model.order_book import Begin, EndBehavior, Instruction, OrderBook, Rest, ShowOrder, Take, Yield
from ui_console.model.orders import Order, OrderKind, OrderState, group

ROBOTS = ("scout1", "scout2")
A_ROBOT = st.sampled_from(ROBOTS)
STICK, MISSION = "stick", "mission"


class Operated(RuleBasedStateMachine):
    """One console, two robots, and a mission that takes every robot that nobody higher wants.

    Work that the book asks for is done later, in any order, as tasks do.
    """

    def __init__(self) -> None:
        super().__init__()
        self.book = OrderBook()
        self.front, self.has_stick = ROBOTS[0], False
        self.starting: set[int] = set()
        self.queued: dict[int, str] = {}
        self.moves: set[int] = set()
        self.finished: set[int] = set()
        self.removing: set[int] = set()
        self.robot_of: dict[int, str] = {}
        self.wanted: set[str] = set()
        self.begun, self.removed, self.finals = Counter[int](), Counter[int](), Counter[int]()

    def holder(self, robot: str) -> str | int:
        """The holder by rank: stick, of equal orders the one that has it already, the mission."""
        if self.has_stick and self.front == robot:
            return STICK
        return min((number for number, of in self.queued.items() if of == robot), default=MISSION)

    def do(self, steps: list[Instruction]) -> None:
        for step in steps:
            match step:
                case Begin(number):
                    self.begun[number] += 1
                    self.starting.add(number)
                case ShowOrder(given):
                    self.robot_of[given.number] = given.order.robot
                    self.finals[given.number] += given.state.is_final
                    if given.state is OrderState.DONE and given.order.then_release:
                        self.wanted.discard(given.order.robot)
                case Rest(number):
                    self.moves.discard(number)
                    if number in self.queued:
                        self.finished.add(number)
                case Yield(_, order):
                    if order.robot == self.front:
                        self.has_stick = False
                case Take(robot):
                    if robot == self.front:
                        self.has_stick = True
                        self.wanted.add(robot)
                case EndBehavior(number):
                    self.removed[number] += 1
                    self.removing.add(number)
        self.tell()

    def tell(self) -> None:
        """Behaviors and stick tell who has which robot."""
        for robot in ROBOTS:
            holder = self.holder(robot)
            if holder == STICK:
                for step in self.book.taken(robot):
                    assert isinstance(step, EndBehavior)
                    self.do([step])
            elif isinstance(holder, int):
                if holder not in self.finished:
                    self.moves.add(holder)
                news = self.book.runs(holder)
                if news:
                    self.do(news)

    @rule(robot=A_ROBOT, then_release=st.booleans())
    def order(self, robot: str, then_release: bool) -> None:
        self.do(self.book.give(Order(OrderKind.GO_TO, robot, 1.0, 1.0, then_release=then_release)))

    @rule()
    def take(self) -> None:
        self.do(self.book.touched(self.front) or [Take(self.front)])

    @rule(robot=A_ROBOT)
    def switch(self, robot: str) -> None:
        present = self.book.orders.get(self.front)
        is_starting = present is not None and present.state is OrderState.STARTING  # then the console waits
        if robot != self.front and not is_starting:
            if self.holder(self.front) == STICK and not self.book.goes_on(self.front):
                self.wanted.discard(self.front)
            self.front, self.has_stick = robot, False
            if not self.book.goes_on(robot):
                self.take()

    @rule()
    def give_back(self) -> None:
        self.wanted.discard(self.front)
        self.has_stick = False
        self.do(self.book.given_back(self.front, "released"))

    @rule()
    def go_away(self) -> None:
        self.has_stick = False
        self.wanted.clear()
        self.do(self.book.away("away"))

    @rule()
    def come_back(self) -> None:
        self.book.back()

    @precondition(lambda self: self.starting)
    @rule(data=st.data())
    def behavior_comes_up(self, data: st.DataObject) -> None:
        number = data.draw(st.sampled_from(sorted(self.starting)))
        self.starting.discard(number)
        self.queued[number] = self.robot_of[number]
        given = self.book.get(number)
        if given is not None and given.state.is_final:
            self.finished.add(number)  # it is asked to rest until it answers
        self.tell()
        self.do(self.book.queued(number))

    @precondition(lambda self: self.starting)
    @rule(data=st.data())
    def start_is_refused(self, data: st.DataObject) -> None:
        number = data.draw(st.sampled_from(sorted(self.starting)))
        self.starting.discard(number)
        self.lose(number)

    @precondition(lambda self: self.queued)
    @rule(data=st.data())
    def behavior_falls(self, data: st.DataObject) -> None:
        number = data.draw(st.sampled_from(sorted(self.queued)))
        self.queued.pop(number)
        self.lose(number)

    def lose(self, number: int) -> None:
        if self.holder(self.robot_of[number]) == MISSION:
            self.wanted.discard(self.robot_of[number])
        self.moves.discard(number)
        self.do(self.book.lost(number, "gone", in_front=self.robot_of[number] == self.front))

    @precondition(lambda self: self.moves)
    @rule(data=st.data(), is_done=st.booleans())
    def behavior_finishes(self, data: st.DataObject, is_done: bool) -> None:
        number = data.draw(st.sampled_from(sorted(self.moves)))
        self.moves.discard(number)
        self.finished.add(number)
        given = self.book.get(number)
        if given is not None and given.order.then_release:
            self.wanted.discard(given.order.robot)
        in_front = self.robot_of[number] == self.front
        self.do(self.book.finished(number, is_done=is_done, why="", in_front=in_front))

    @precondition(lambda self: self.queued)
    @rule(data=st.data())
    def is_suspended(self, data: st.DataObject) -> None:
        self.do(self.book.waits(data.draw(st.sampled_from(sorted(self.queued))), "higher by ben"))

    @precondition(lambda self: self.removing)
    @rule(data=st.data())
    def removal_is_over(self, data: st.DataObject) -> None:
        self.end(data.draw(st.sampled_from(sorted(self.removing))))

    def end(self, number: int) -> None:
        self.removing.discard(number)
        self.starting.discard(number)
        self.queued.pop(number, None)
        self.moves.discard(number)
        self.book.removed(number)
        self.tell()

    @invariant()
    def a_robot_that_the_operator_wants_is_never_the_missions(self) -> None:
        for robot in self.wanted:
            assert self.holder(robot) != MISSION, robot

    @invariant()
    def one_order_of_a_robot_goes_on(self) -> None:
        there = [given for number in self.book.numbers if (given := self.book.get(number)) is not None]
        assert all(count == 1 for count in Counter(one.order.robot for one in there if not one.state.is_final).values())

    @invariant()
    def nothing_happens_twice(self) -> None:
        assert all(count <= 1 for counts in (self.begun, self.removed, self.finals) for count in counts.values())

    @invariant()
    def an_order_that_is_over_moves_nothing(self) -> None:
        for number in self.moves - self.removing:
            given = self.book.get(number)
            assert given is not None
            assert not given.state.is_final

    def teardown(self) -> None:
        """At the end every behavior that was begun is removed."""
        for robot in ROBOTS:
            self.do(self.book.given_back(robot, "the console ends"))
        for number in sorted(self.removing):
            self.end(number)
        assert self.removed.keys() == self.begun.keys()
        assert not self.book.numbers


TestOrders = Operated.TestCase
TestOrders.settings = settings(max_examples=share(200), stateful_step_count=30, deadline=None)


def test_a_touch_lets_the_robot_rest_before_the_stick_asks_for_it() -> None:
    book = OrderBook()
    book.give(Order(OrderKind.RETURN, "scout1"))
    book.queued(1)
    book.runs(1)
    assert [type(step) for step in book.touched("scout1")] == [Rest, ShowOrder, Take]
    assert book.touched("scout2") == []


def test_a_touch_before_the_behavior_is_there_leaves_the_stick_its_robot() -> None:
    book = OrderBook()
    book.give(Order(OrderKind.RETURN, "scout1"))
    book.touched("scout1")
    assert book.queued(1) == []
    assert book.taken("scout1") == [EndBehavior(1)]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_places_of_a_group_lie_apart_around_the_one_that_was_meant(count: int) -> None:
    robots = [f"scout{number}" for number in range(count)]
    places = [order.x_m for order in group(Order(OrderKind.GO_TO, "", 2.0, 1.0), robots)]
    assert sum(places) / count == pytest.approx(2.0)
    assert all(later - earlier == pytest.approx(0.5) for earlier, later in pairwise(places))
