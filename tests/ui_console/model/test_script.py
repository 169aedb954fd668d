"""Laws of scripts: a wrong line is refused with its number; a right one is played in its time."""

import json
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ui_console.model.driving import (
    REPEAT_EVERY_S,
    DriveWish,
    GiveBack,
    GiveWish,
    HaltWish,
    MoveWish,
    OrderWish,
    StopAll,
    StopRobot,
    Wish,
)
from ui_console.model.orders import Order, OrderKind
from ui_console.model.script import ScriptPlayer, ScriptReader, Step, WrongScript, read_script

EXAMPLE = '{"at_s":0.5,"left_rad_s":4,"right_rad_s":4}\n{"at_s":3,"release":true}\n'


def play(player: ScriptPlayer, until_s: float) -> list[tuple[float, Wish]]:
    """Ask only when the player said so, as the loop does."""
    done: list[tuple[float, Wish]] = []
    now_s = 0.0
    while now_s <= until_s:
        done += [(now_s, wish) for wish in player.due(now_s)]
        if player.next_s is None:
            break
        assert player.next_s >= now_s
        now_s = player.next_s
    return done


def test_the_example_drives_from_its_time_until_the_release() -> None:
    done = play(ScriptPlayer(read_script(EXAMPLE)), 10.0)
    assert done[0] == (0.5, DriveWish(4.0, 4.0))
    assert done[-1] == (3.0, GiveBack())
    times = [at_s for at_s, _wish in done]
    assert all(later - earlier <= REPEAT_EVERY_S + 1e-9 for earlier, later in pairwise(times))


def test_the_end_of_a_script_releases() -> None:
    assert play(ScriptPlayer(read_script('{"at_s":1,"halt":true}')), 5.0) == [(1.0, HaltWish()), (1.0, GiveBack())]
    assert play(ScriptPlayer([]), 5.0) == [(0.0, GiveBack())]


def test_after_a_halt_nothing_is_repeated() -> None:
    script = '{"at_s":0,"left_rad_s":1,"right_rad_s":1}\n{"at_s":0.2,"halt":true}\n{"at_s":5,"release":true}'
    done = play(ScriptPlayer(read_script(script)), 10.0)
    assert [wish for at_s, wish in done if at_s > 0.15] == [HaltWish(), GiveBack()]


def test_a_jump_does_not_interrupt_a_drive() -> None:
    script = '{"at_s":0,"left_rad_s":1,"right_rad_s":1}\n{"at_s":0.25,"jump":true}\n{"at_s":0.6,"release":true}'
    wishes = [wish for _at_s, wish in play(ScriptPlayer(read_script(script)), 10.0)]
    assert wishes.count(GiveWish("jump")) == 1
    assert wishes[-2] == DriveWish(1.0, 1.0)


@pytest.mark.parametrize(
    ("line", "step"),
    [
        ('{"at_s":2,"stop_robot":"scout2","reason":"a child"}', Step(2.0, StopRobot("scout2", "a child"))),
        ('{"stop_robot":"scout2"}', Step(0.0, StopRobot("scout2"), at_once=True)),
        ('{"stop_all":true}', Step(0.0, StopAll(), at_once=True)),
    ],
)
def test_an_emergency_stop_needs_no_time(line: str, step: Step) -> None:
    assert read_script(line) == [step]


def test_a_stop_of_another_robot_does_not_end_the_drive() -> None:
    script = '{"at_s":0,"left_rad_s":1,"right_rad_s":1}\n{"at_s":0.25,"stop_robot":"x"}\n{"at_s":0.6,"release":true}'
    wishes = [wish for _at_s, wish in play(ScriptPlayer(read_script(script)), 10.0)]
    assert wishes.count(StopRobot("x")) == 1
    assert wishes[-2] == DriveWish(1.0, 1.0)


def test_when_letting_go_is_required_nothing_moves_before_a_line_that_halts() -> None:
    player = ScriptPlayer()
    player.add(Step(0.0, DriveWish(1.0, 1.0)))
    assert player.due(0.0) == [DriveWish(1.0, 1.0)]
    player.require_let_go()
    assert player.due(1.0) == []
    for step in (Step(1.1, DriveWish(2.0, 2.0)), Step(1.2, GiveWish("jump"))):
        player.add(step)
    assert player.due(1.5) == []
    assert player.held_back == 2
    for step in (Step(1.6, HaltWish()), Step(1.7, DriveWish(3.0, 3.0))):
        player.add(step)
    assert player.due(2.0) == [HaltWish(), DriveWish(3.0, 3.0)]


def test_a_streamed_script_waits_for_its_next_line_and_repeats_the_last_meanwhile() -> None:
    player = ScriptPlayer()
    assert player.next_s is None
    player.add(Step(0.0, DriveWish(1.0, 1.0)))
    assert player.due(0.0) == [DriveWish(1.0, 1.0)]
    assert player.due(0.05) == []
    assert player.due(2.0) == [DriveWish(1.0, 1.0)]
    player.end()
    assert player.due(2.01) == [GiveBack()]
    assert player.is_over


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ("drive", "malformed"),
        ('{"left_rad_s":1,"right_rad_s":1}', "at_s"),
        ('{"at_s":0}', "exactly one"),
        ('{"at_s":0,"halt":true,"jump":true}', "exactly one"),
        ('{"at_s":0,"halt":true,"order":"return_home"}', "exactly one"),
        ('{"at_s":0,"order":"dance"}', "Invalid enum value"),
        ('{"at_s":0,"order":"go_to","x_m":1}', "both of them"),
        ('{"at_s":0,"order":"return_home","x_m":1,"y_m":1}', "both of them"),
        ('{"at_s":0,"order":"follow"}', "a target belongs to follow"),
        ('{"at_s":0,"order":"return_home","target":"anna"}', "a target belongs to follow"),
        ('{"at_s":0,"halt":true,"until_done":true}', "belong to an order"),
        ('{"at_s":0,"left_rad_s":1}', "belong together"),
        ('{"at_s":0,"left_rad_s":1e999,"right_rad_s":1}', ""),
        ('{"at_s":0,"forward_m_s":1,"left_rad_s":1,"right_rad_s":1}', "exactly one"),
        ('{"at_s":0,"turn_rad_s":1e999}', ""),
        ('{"at_s":0,"give":"shine","jump":true}', "exactly one"),
        ('{"at_s":0,"halt":true,"values":{"brightness":1}}', "belong to a command by give"),
        ('{"at_s":0,"give":"shine","values":{"brightness":[1]}}', "values"),
        ('{"at_s":-1,"halt":true}', "comes after"),
        ('{"at_s":0,"halt":true,"color":"red"}', "color"),
        ('{"at_s":"now","halt":true}', "float"),
        ("[]", "object"),
    ],
)
def test_a_wrong_line_is_refused_with_its_number(line: str, complaint: str) -> None:
    with pytest.raises(WrongScript, match="line 3") as refused:
        read_script('{"at_s":0,"halt":true}\n\n' + line)
    assert refused.value.facts["line"] == 3
    assert complaint in refused.value.detail


def test_time_may_not_run_backwards_and_nothing_follows_a_release() -> None:
    reader = ScriptReader()
    reader.read('{"at_s":2,"halt":true}')
    with pytest.raises(WrongScript, match="comes after"):
        reader.read('{"at_s":1,"halt":true}')
    with pytest.raises(WrongScript, match="release"):
        read_script('{"at_s":0,"release":true}\n{"at_s":1,"halt":true}')


@pytest.mark.parametrize(
    ("line", "wish"),
    [
        ('{"at_s":0,"forward_m_s":0.1,"turn_rad_s":-1}', MoveWish(0.1, -1.0)),
        ('{"at_s":0,"forward_m_s":0.1}', MoveWish(0.1, 0.0)),
        ('{"at_s":0,"turn_rad_s":1}', MoveWish(0.0, 1.0)),
        ('{"at_s":0,"jump":true}', GiveWish("jump")),
        (
            '{"at_s":0,"give":"shine","values":{"brightness":0.5},"role":"lamp"}',
            GiveWish("shine", {"brightness": 0.5}, "lamp"),
        ),
    ],
)
def test_a_line_moves_any_body_and_gives_any_command(line: str, wish: Wish) -> None:
    assert [step.wish for step in read_script(line)] == [wish]


def test_after_a_stop_a_command_that_moves_nothing_is_given_without_a_halt() -> None:
    shine, jump = GiveWish("shine", {"brightness": 1.0}), GiveWish("jump")
    player = ScriptPlayer(None, moves=lambda word: word != "shine")
    player.require_let_go()
    for wish in (shine, jump, MoveWish(0.1, 0.0)):
        player.add(Step(0.0, wish))
    assert player.due(1.0) == [shine]
    assert player.held_back == 2


_speeds = st.floats(-30.0, 30.0)
_motions = st.one_of(st.builds(DriveWish, _speeds, _speeds), st.builds(MoveWish, _speeds, _speeds))
_wishes = st.one_of(_motions, st.just(HaltWish()), st.just(GiveWish("jump")))
_scripts = st.lists(st.tuples(st.floats(0.0, 3.0), _wishes), max_size=12).map(
    lambda steps: [Step(at_s, wish) for at_s, wish in sorted(steps, key=lambda step: step[0])]
)


@given(_scripts)
def test_every_step_is_done_once_in_order_at_its_time_and_the_release_comes_last(steps: list[Step]) -> None:
    done = play(ScriptPlayer(steps), 100.0)
    assert [wish for _at_s, wish in done].count(GiveBack()) == 1
    assert done[-1][1] == GiveBack()
    left = list(steps)
    for at_s, wish in done[:-1]:
        if left and wish is left[0].wish:
            assert at_s == left.pop(0).at_s
        else:
            assert isinstance(wish, DriveWish | MoveWish)
    assert left == []


@given(st.binary(max_size=60))
def test_any_bytes_are_a_step_or_a_refusal(raw: bytes) -> None:
    try:
        read_script(raw.decode(errors="replace"))
    except WrongScript as refusal:
        json.dumps(refusal.facts["line"])


def test_what_follows_an_order_waits_until_it_is_over() -> None:
    order = OrderWish(Order(OrderKind.GO_TO, "", 2.0, 1.0), until_done=True)
    lines = [
        '{"at_s":0,"forward_m_s":0.1}',
        '{"at_s":1,"order":"go_to","x_m":2,"y_m":1,"until_done":true}',
        '{"at_s":2,"halt":true}',
    ]
    player = ScriptPlayer(read_script("\n".join(lines)))
    assert player.due(0.0) == [MoveWish(0.1, 0.0)]
    assert player.due(1.0) == [order], "the drive before is over"
    assert (player.due(60.0), player.next_s, player.waits) == ([], None, True)
    player.order_over()
    assert player.due(60.0) == [HaltWish(), GiveBack()]


def test_an_order_that_is_not_waited_for_goes_on_beside_the_script() -> None:
    player = ScriptPlayer(
        read_script('{"at_s":0,"order":"follow","target":"anna","robot":"scout2"}\n{"at_s":1,"halt":true}')
    )
    assert player.due(0.0) == [OrderWish(Order(OrderKind.FOLLOW, "scout2", target="anna"))]
    assert player.due(1.0) == [HaltWish(), GiveBack()]
