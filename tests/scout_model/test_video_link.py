"""What a receiver gets: each effect by itself, seeded, and in the papers' proportions together."""

from __future__ import annotations

import itertools
from collections import Counter

import msgspec
import numpy as np
import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from scout_model.air import FADE_S, FADED_SHARE, REFERENCE_M
from scout_model.description import AS_THE_PAPERS, CLEAN_AIR, AirDescription
from scout_model.dimensions import FRAMES_PER_S
from scout_model.video_link import SETTLING_S, FrameKind, Receiver, Signal

GRAY = np.full((240, 320), 120, np.uint8)
STRIPES: NDArray[np.uint8] = np.tile(np.repeat(np.array([40, 200], np.uint8), 40), (240, 4))
BARS = np.ascontiguousarray(np.tile(np.linspace(0, 255, 240).astype(np.uint8), (320, 1)).T)
DIAGONAL = np.add.outer(np.arange(240), np.arange(320)).astype(np.uint8)
NOISES = ("white_noise", "tears", "ghosts", "fades", "partial_frames")
SETTLED = round(SETTLING_S * FRAMES_PER_S)


def only(effect: str, strength: float = 1.0) -> AirDescription:
    """Return air with one of the five kinds of noise alone."""
    none = dict.fromkeys(NOISES, 0.0)
    return msgspec.structs.replace(CLEAN_AIR, **{**none, "noise": 1.0, effect: strength})


def error(received: NDArray[np.uint8], sent: NDArray[np.uint8]) -> float:
    return float(np.abs(received.astype(int) - sent).mean())


def received(air: AirDescription, frames: int, signal: Signal, seed: int = 1) -> list[NDArray[np.uint8]]:
    receiver = Receiver(seed, "video1", air)
    return [receiver.receive([signal], frame).picture for frame in range(frames)]


def kinds(air: AirDescription, frames: int, signal: Signal, seed: int = 1, every: int = 1) -> list[FrameKind]:
    receiver = Receiver(seed, "video1", air)
    return [receiver.receive([signal], frame).kind for frame in range(0, frames, every)]


@pytest.mark.parametrize("sent", [STRIPES, GRAY, BARS])
def test_in_clean_air_a_picture_arrives_as_it_was_sent(sent: NDArray[np.uint8]) -> None:
    receiver = Receiver(1, "video1", CLEAN_AIR)
    for frame in range(100):
        reception = receiver.receive([Signal(sent, "scout1", 30.0, motors=1.0, on_since_frame=frame)], frame)
        assert np.array_equal(reception.picture, sent)
        assert (reception.transmitters, reception.kind) == (1, FrameKind.CLEAN)


def test_in_mild_air_most_frames_have_only_a_little_noise() -> None:
    pictures = received(AirDescription(), 300, Signal(STRIPES))[SETTLED:]
    errors = np.array([error(picture, STRIPES) for picture in pictures])
    assert all(picture.shape == (240, 320) and picture.dtype == np.uint8 for picture in pictures)
    assert 0.3 < np.median(errors) < 3.0
    assert np.mean(errors < 5.0) > 0.85


def test_noise_does_not_wrap_around_black_and_white() -> None:
    black_and_white = np.where(np.arange(320) < 160, 0, 255).astype(np.uint8) * np.ones((240, 1), np.uint8)
    for picture in received(only("white_noise"), 20, Signal(black_and_white)):
        assert error(picture, black_and_white) < 8.0


def test_white_noise_grows_with_distance() -> None:
    deviations = [
        received(msgspec.structs.replace(only("white_noise"), weak_signal=1.0), 1, Signal(GRAY, distance_m=away_m))[
            0
        ].std()
        for away_m in (1.0, 4.0, 8.0, 16.0)
    ]
    assert all(near < far for near, far in itertools.pairwise(deviations))
    assert 4.0 < deviations[1] < 8.0  # 32.8 dB below white


def test_without_weak_signal_distance_changes_nothing() -> None:
    air = msgspec.structs.replace(AS_THE_PAPERS, weak_signal=0.0)
    near, far = (received(air, 60, Signal(STRIPES, distance_m=away_m)) for away_m in (1.0, 40.0))
    assert all(np.array_equal(one, other) for one, other in zip(near, far, strict=True))


def test_far_away_contrast_fades_to_gray() -> None:
    air = msgspec.structs.replace(only("white_noise", 0.0), weak_signal=1.0)
    contrasts = [float(received(air, 1, Signal(STRIPES, distance_m=away_m))[0].std()) for away_m in (10, 40, 80, 130)]
    assert contrasts[0] == STRIPES.std()
    assert all(near > far for near, far in itertools.pairwise(contrasts))


@pytest.mark.parametrize(("motors", "expected"), [(0.0, 0.01), (0.2, 1.01), (1.0, 5.01)])
def test_tears_are_lines_one_to_three_rows_high_and_come_with_the_motors(motors: float, expected: float) -> None:
    lines, heights = 0, 0
    for picture in received(only("tears"), 400, Signal(DIAGONAL, motors=motors)):
        torn = (picture != DIAGONAL).any(axis=1)
        lines += np.count_nonzero(np.diff(np.concatenate([[False], torn]).astype(int)) == 1)
        heights += np.count_nonzero(torn)
    assert lines / 400 == pytest.approx(expected, rel=0.15, abs=0.02)  # two lines in one place count once
    assert lines <= heights <= 3.2 * lines


def test_a_ghost_is_the_same_picture_a_little_to_the_right() -> None:
    edge = np.where(np.arange(320) < 160, 50, 200).astype(np.uint8) * np.ones((240, 1), np.uint8)
    for picture in received(only("ghosts", 5.0), 60, Signal(edge)):
        changed = np.flatnonzero((picture != edge).any(axis=0))
        assert changed.size == 0 or (changed.min() >= 160 and changed.max() < 170)


def test_a_ghost_stays_in_its_row() -> None:
    one = np.random.default_rng(1).integers(0, 256, (240, 320)).astype(np.uint8)
    other = one.copy()
    other[100] = 255 - other[100]
    air = only("ghosts", 5.0)
    for first, second in zip(received(air, 30, Signal(one)), received(air, 30, Signal(other)), strict=True):
        assert np.array_equal(first[:, :9], one[:, :9])
        assert np.flatnonzero((first != second).any(axis=1)).tolist() == [100]


def test_ghosts_come_and_go() -> None:
    found = Counter(kinds(only("ghosts", 3.0), 900, Signal(STRIPES)))
    assert 0.2 < found[FrameKind.GHOST] / 900 < 0.8


def test_a_partial_frame_is_whole_above_and_wrong_in_whole_rows_below() -> None:
    seen = Counter[str]()
    receiver = Receiver(1, "video1", only("partial_frames", 10.0))
    for frame in range(600):
        sent = np.full((240, 320), 60 + frame % 100, np.uint8)
        reception = receiver.receive([Signal(sent)], frame)
        wrong = (reception.picture != sent).mean(axis=1) > 0.5
        assert (reception.kind is FrameKind.PARTIAL) == bool(wrong.any())
        if wrong.any():
            first = int(np.argmax(wrong))
            assert wrong[first:].all()
            assert not wrong[:first].any()
            below = reception.picture[first:]
            seen["black" if not below.any() else "noise" if below.std() > 30 else "stale"] += 1
    assert set(seen) == {"black", "noise", "stale"}


def test_the_older_picture_in_a_partial_frame_is_none_from_before_the_tuning() -> None:
    receiver = Receiver(1, "video1", only("partial_frames", 10.0))
    receiver.receive([Signal(np.full((240, 320), 200, np.uint8))], 0)
    for frame in range(1, 400):
        receiver.tune()
        picture = receiver.receive([Signal(GRAY)], frame).picture
        assert (picture == 200).mean() < 0.05


def bursts(bad: NDArray[np.bool_]) -> float:
    """Return how long bad frames last in a row, on average, in frames."""
    return float(bad.sum() / max(1, np.count_nonzero(np.diff(np.concatenate([[False], bad]).astype(int)) == 1)))


def test_as_in_the_papers_three_quarters_of_the_frames_are_clean_and_the_others_come_in_bursts() -> None:
    rate_hz, clean, lengths = 15, [], []
    for seed in range(6):
        receiver = Receiver(seed, "video1", msgspec.structs.replace(AS_THE_PAPERS, white_noise=0.0))
        told = [
            receiver.receive([Signal(GRAY, "scout1", REFERENCE_M)], frame).kind
            for frame in range(0, 60 * FRAMES_PER_S, FRAMES_PER_S // rate_hz)
        ]
        bad = np.array([kind is not FrameKind.CLEAN for kind in told[SETTLED:]])
        lost = np.array([kind in (FrameKind.FADED, FrameKind.PARTIAL) for kind in told[SETTLED:]])
        clean.append(1.0 - bad.mean())
        lengths.append(bursts(lost) / rate_hz)
    assert np.mean(clean) == pytest.approx(1.0 - FADED_SHARE, abs=0.04)
    assert np.mean(lengths) == pytest.approx(FADE_S, rel=0.2)


def test_the_share_of_clean_frames_falls_with_distance() -> None:
    shares = []
    for away_m in (2.0, 4.0, 6.0, 9.0):
        told = kinds(
            msgspec.structs.replace(AS_THE_PAPERS, white_noise=0.0),
            60 * FRAMES_PER_S,
            Signal(GRAY, "scout1", away_m),
            every=3,
        )
        shares.append(told.count(FrameKind.CLEAN) / len(told))
    assert shares[0] > 0.88
    assert all(near > far + 0.05 for near, far in itertools.pairwise(shares))


@pytest.mark.parametrize("noise", [0.0, 0.25, 1.0, 2.0])
def test_one_scale_sets_how_much_of_the_time_is_faded(noise: float) -> None:
    air = msgspec.structs.replace(only("fades"), noise=noise)
    signal = Signal(GRAY, "scout1")
    told = [kind for seed in range(3) for kind in kinds(air, 60 * FRAMES_PER_S, signal, seed, every=3)]
    expected = 1.0 - (1.0 - FADED_SHARE) ** noise
    assert told.count(FrameKind.FADED) / len(told) == pytest.approx(expected, abs=0.04)


def test_a_faded_frame_has_the_rows_of_the_picture_but_most_in_another_place_and_brightness() -> None:
    receiver = Receiver(1, "video1", only("fades", 4.0))
    faded = 0
    for frame in range(100):
        reception = receiver.receive([Signal(STRIPES)], frame)
        assert all(len(set(row.tolist())) <= 2 for row in reception.picture)
        if reception.kind is FrameKind.FADED:
            faded += 1
            off_levels = np.abs(reception.picture.astype(int) - STRIPES).mean(axis=1)
            assert (off_levels > 15).mean() > 0.5, "most rows are drastically different"
        else:
            assert np.array_equal(reception.picture, STRIPES)
    assert faded > 20


def test_two_robots_fade_at_different_times() -> None:
    one, other = (kinds(only("fades"), 900, Signal(GRAY, robot)) for robot in ("scout1", "scout2"))
    assert one != other


@pytest.mark.parametrize("switched", ["transmitter", "receiver"])
def test_after_switching_the_picture_settles_within_its_time(switched: str) -> None:
    receiver = Receiver(1, "video1", msgspec.structs.replace(CLEAN_AIR, settling=1.0))
    for frame in range(SETTLED + 5):
        receiver.receive([Signal(BARS)] if switched == "receiver" else [], frame)
    if switched == "receiver":
        receiver.tune()
    begin = SETTLED + 5
    for frame in range(begin, begin + 2 * SETTLED):
        signal = Signal(BARS, on_since_frame=begin if switched == "transmitter" else 0)
        reception = receiver.receive([signal], frame)
        assert (reception.kind is FrameKind.SETTLING) == (frame < begin + SETTLED)
        assert np.array_equal(reception.picture, BARS) == (frame >= begin + SETTLED)


def test_without_a_transmitter_there_is_snow_or_gray() -> None:
    reception = Receiver(1, "video1").receive([], frame=7)
    assert (reception.transmitters, reception.kind) == (0, FrameKind.SNOW)
    assert reception.picture.std() > 50
    assert np.all(Receiver(1, "video1", CLEAN_AIR).receive([], frame=7).picture == 128)


def test_two_transmitters_give_a_picture_of_neither() -> None:
    receiver = Receiver(1, "video1")
    for frame in range(20):
        reception = receiver.receive([Signal(STRIPES, "scout1"), Signal(GRAY, "scout2")], frame)
        assert (reception.transmitters, reception.kind) == (2, FrameKind.GARBAGE)
        assert error(reception.picture, STRIPES) > 20
        assert error(reception.picture, GRAY) > 20


def test_without_interference_the_nearer_of_two_is_received() -> None:
    signals = [Signal(STRIPES, "scout1", 3.0), Signal(GRAY, "scout2", 2.0)]
    reception = Receiver(1, "video1", CLEAN_AIR).receive(signals, 0)
    assert reception.transmitters == 2
    assert np.array_equal(reception.picture, GRAY)


def test_half_the_interference_leaves_half_of_the_nearers_rows_in_place() -> None:
    air = msgspec.structs.replace(CLEAN_AIR, interference=0.5)
    picture = Receiver(1, "video1", air).receive([Signal(STRIPES, "scout1", 2.0), Signal(GRAY, "scout2")], 0).picture
    alike = [np.corrcoef(row, STRIPES[0])[0, 1] > 0.8 for row in picture.astype(float)]
    assert 0.4 < np.mean(alike) < 0.75


@pytest.mark.parametrize("air", [AirDescription(), AS_THE_PAPERS], ids=["mild", "papers"])
@pytest.mark.parametrize("signals", [[], [Signal(STRIPES, motors=1.0)], [Signal(STRIPES), Signal(GRAY)]])
@pytest.mark.parametrize("keeps_noise", [True, False])
def test_the_same_course_of_signals_is_received_the_same_way_again(
    air: AirDescription, signals: list[Signal], keeps_noise: bool
) -> None:
    first, second = Receiver(1, "video1", air), Receiver(1, "video1", air, keeps_noise=keeps_noise)
    for frame in range(60):
        assert np.array_equal(first.receive(signals, frame).picture, second.receive(signals, frame).picture)


def test_what_was_received_before_the_tuning_plays_no_part() -> None:
    used, new = Receiver(1, "video1", AS_THE_PAPERS), Receiver(1, "video1", AS_THE_PAPERS)
    for frame in range(50):
        used.receive([Signal(STRIPES), Signal(GRAY)], frame)
    used.tune()
    for frame in range(50, 150):
        signal = Signal(BARS, motors=0.5)
        assert np.array_equal(used.receive([signal], frame).picture, new.receive([signal], frame).picture)


@pytest.mark.parametrize("signals", [[], [Signal(STRIPES)], [Signal(STRIPES), Signal(GRAY)]])
def test_another_frame_seed_or_frequency_has_other_noise(signals: list[Signal]) -> None:
    picture = Receiver(1, "video1", AS_THE_PAPERS).receive(signals, frame=8).picture
    for other in (
        Receiver(1, "video1", AS_THE_PAPERS).receive(signals, 9),
        Receiver(2, "video1", AS_THE_PAPERS).receive(signals, 8),
        Receiver(1, "video2", AS_THE_PAPERS).receive(signals, 8),
    ):
        assert not np.array_equal(picture, other.picture)


@pytest.mark.parametrize(
    ("effect", "shown_as"),
    [
        ("white_noise", set()),
        ("tears", {FrameKind.TORN}),
        ("ghosts", {FrameKind.GHOST}),
        ("fades", {FrameKind.FADED, FrameKind.PARTIAL}),
        ("partial_frames", {FrameKind.PARTIAL}),
    ],
)
def test_an_effect_switched_off_leaves_the_others_as_they_were(effect: str, shown_as: set[FrameKind]) -> None:
    air = msgspec.structs.replace(AS_THE_PAPERS, ghosts=2.0)
    signal = Signal(STRIPES, "scout1", motors=0.1)
    all_on = kinds(air, 600, signal)
    one_off = kinds(msgspec.structs.replace(air, **{effect: 0.0}), 600, signal)
    assert {kind for kind, left in zip(all_on, one_off, strict=True) if kind is not left} <= shown_as
    assert shown_as <= set(all_on)


@settings(max_examples=share(30))
@given(
    effect=st.sampled_from(NOISES),
    scale=st.floats(0, 10),
    noise=st.floats(0, 10),
    away_m=st.floats(0.1, 500),
    motors=st.floats(0, 1),
    frame=st.integers(0, 1_000_000),
)
def test_whatever_the_air_a_frame_comes_out(
    effect: str, scale: float, noise: float, away_m: float, motors: float, frame: int
) -> None:
    air = msgspec.structs.replace(AirDescription(noise=noise), **{effect: scale})
    reception = Receiver(3, "video1", air).receive([Signal(STRIPES, "scout1", away_m, motors)], frame)
    assert (reception.picture.shape, reception.picture.dtype) == ((240, 320), np.uint8)


def test_the_sent_picture_and_what_comes_later_are_left_alone_by_whoever_paints_on_a_reception() -> None:
    for air in (CLEAN_AIR, AS_THE_PAPERS, only("partial_frames", 10.0)):
        sent = STRIPES.copy()
        sent.flags.writeable = False
        painted, other = Receiver(1, "video1", air), Receiver(1, "video1", air)
        for frame in range(60):
            picture = painted.receive([Signal(sent)], frame).picture
            assert np.array_equal(picture, other.receive([Signal(sent)], frame).picture)
            picture[:] = 0
        assert np.array_equal(sent, STRIPES)


@pytest.mark.parametrize(
    "signal",
    [
        Signal(GRAY[:100]),
        Signal(GRAY.astype(np.int16)),  # type: ignore[arg-type]
        Signal(GRAY, distance_m=0.0),
        Signal(GRAY, distance_m=float("nan")),
        Signal(GRAY, motors=1.5),
        Signal(GRAY, motors=float("nan")),
    ],
)
def test_a_signal_that_cannot_be_is_refused(signal: Signal) -> None:
    with pytest.raises(ValueError, match=r"picture|distance_m|motors"):
        Receiver(1, "video1").receive([signal], 0)


def test_a_negative_frame_is_refused() -> None:
    with pytest.raises(ValueError, match="frame"):
        Receiver(1, "video1").receive([], -1)
