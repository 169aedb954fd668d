from hypothesis import given
from hypothesis import strategies as st

from scout_model import radio_link
from scout_model.dimensions import COMMAND_TIMEOUT_S, FOOT_PRELOAD_M, FOOT_STROKE_M, WHEEL_SPEED_LIMIT_RAD_S
from scout_model.scout import Firmware, Spring

FRAME_S = 1 / 30
drives = st.builds(radio_link.encode_drive, st.floats(-100, 100), st.floats(-100, 100))
commands = st.sampled_from(
    [
        radio_link.encode_halt(),
        radio_link.encode_jump(),
        radio_link.encode_safe(),
        radio_link.encode_transmitter_off(),
        radio_link.encode_transmitter_on("video1"),
    ]
)
packets = st.one_of(drives, commands, st.binary(max_size=12))


def jump(firmware: Firmware, begin_s: float, end_s: float, *, keep_alive: bool = True) -> list[Spring]:
    """Ask for a jump and return the phases the spring goes through until end_s."""
    firmware.hear(radio_link.encode_jump(), begin_s)
    phases: list[Spring] = []
    for frame in range(round((end_s - begin_s) / FRAME_S)):
        now_s = begin_s + frame * FRAME_S
        if keep_alive:
            firmware.hear(radio_link.encode_drive(0.0, 0.0), now_s)
        firmware.tick(now_s)
        if firmware.spring not in phases[-1:]:
            phases.append(firmware.spring)
    return phases


@given(st.lists(st.tuples(packets, st.integers(0, 20)), max_size=30))
def test_whatever_it_hears_speeds_and_winch_stay_within_their_limits(heard: list[tuple[bytes, int]]) -> None:
    firmware, now_s = Firmware(), 0.0
    for payload, frames in heard:
        firmware.hear(payload, now_s)
        for _ in range(frames):
            actuation = firmware.tick(now_s)
            assert abs(actuation.left_rad_s) <= WHEEL_SPEED_LIMIT_RAD_S
            assert abs(actuation.right_rad_s) <= WHEEL_SPEED_LIMIT_RAD_S
            assert 0.0 <= actuation.winch_m <= FOOT_STROKE_M
            assert not actuation.kick or firmware.spring is Spring.KICKING
            now_s += FRAME_S


@given(st.lists(packets, max_size=10))
def test_half_a_second_after_the_last_packet_it_neither_moves_nor_transmits(heard: list[bytes]) -> None:
    firmware = Firmware()
    for payload in heard:
        firmware.hear(payload, 1.0)
    actuation = firmware.tick(1.0 + COMMAND_TIMEOUT_S)
    assert (actuation.left_rad_s, actuation.right_rad_s, firmware.frequency) == (0.0, 0.0, "")


def test_noise_does_not_keep_it_driving() -> None:
    firmware = Firmware()
    firmware.hear(radio_link.encode_drive(3.0, 3.0), 0.0)
    firmware.hear(b"noise", 0.4)
    assert firmware.tick(0.4).left_rad_s == 3.0
    assert firmware.tick(0.6).left_rad_s == 0.0


def test_speeds_beyond_the_motors_are_clipped() -> None:
    firmware = Firmware()
    firmware.hear(radio_link.encode_drive(99.0, -99.0), 0.0)
    assert firmware.tick(0.0).left_rad_s == WHEEL_SPEED_LIMIT_RAD_S
    assert firmware.tick(0.0).right_rad_s == -WHEEL_SPEED_LIMIT_RAD_S


def test_safe_stops_wheels_and_transmitter_at_once() -> None:
    firmware = Firmware()
    firmware.hear(radio_link.encode_drive(3.0, 3.0), 0.0)
    firmware.hear(radio_link.encode_transmitter_on("video1"), 0.0)
    firmware.hear(radio_link.encode_safe(), 0.0)
    assert (firmware.tick(0.0).left_rad_s, firmware.frequency) == (0.0, "")


def test_a_jump_is_preload_kick_rewind_and_wound_again() -> None:
    phases = jump(Firmware(), 0.0, 3.0)
    assert phases == [Spring.PRELOADING, Spring.KICKING, Spring.REWINDING, Spring.WOUND]


def test_a_second_jump_is_refused_until_the_spring_is_wound() -> None:
    firmware = Firmware()
    jump(firmware, 0.0, 1.0)
    assert jump(firmware, 1.0, 4.0) == [Spring.REWINDING, Spring.WOUND]
    assert jump(firmware, 4.0, 5.0) == [Spring.PRELOADING, Spring.KICKING, Spring.REWINDING]


def test_halt_before_the_kick_cancels_the_jump() -> None:
    firmware = Firmware()
    firmware.hear(radio_link.encode_jump(), 0.0)
    assert firmware.tick(0.1).winch_m == FOOT_PRELOAD_M
    firmware.hear(radio_link.encode_halt(), 0.1)
    assert not any(firmware.tick(0.1 + frame * FRAME_S).kick for frame in range(30))
    assert firmware.spring is Spring.WOUND


def test_silence_after_the_kick_does_not_keep_the_spring_from_winding() -> None:
    assert jump(Firmware(), 0.0, 3.0, keep_alive=False)[-1] is Spring.WOUND
