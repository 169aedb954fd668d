import numpy as np
import pytest
from numpy.typing import NDArray

from scout_model.video_link import Receiver

GRAY = np.full((240, 320), 120, np.uint8)
STRIPES: NDArray[np.uint8] = np.tile(np.repeat(np.array([40, 200], np.uint8), 40), (240, 4))


def error(received: NDArray[np.uint8], sent: NDArray[np.uint8]) -> float:
    return float(np.abs(received.astype(int) - sent).mean())


def test_one_transmitter_gives_its_picture_with_a_little_noise() -> None:
    reception = Receiver(1, "video1").receive([STRIPES], frame=7)
    assert reception.transmitters == 1
    assert reception.picture.shape == (240, 320)
    assert reception.picture.dtype == np.uint8
    assert 0.5 < error(reception.picture, STRIPES) < 8.0


def test_noise_does_not_wrap_around_black_and_white() -> None:
    black_and_white = np.where(np.arange(320) < 160, 0, 255).astype(np.uint8) * np.ones((240, 1), np.uint8)
    assert error(Receiver(1, "video1").receive([black_and_white], 0).picture, black_and_white) < 8.0


def test_without_a_transmitter_there_is_snow() -> None:
    reception = Receiver(1, "video1").receive([], frame=7)
    assert reception.transmitters == 0
    assert reception.picture.std() > 50


def test_two_transmitters_give_a_picture_of_neither() -> None:
    reception = Receiver(1, "video1").receive([STRIPES, GRAY], frame=7)
    assert reception.transmitters == 2
    assert error(reception.picture, STRIPES) > 20
    assert error(reception.picture, GRAY) > 20


@pytest.mark.parametrize("sent", [[], [STRIPES], [STRIPES, GRAY]])
def test_the_same_frame_is_received_the_same_way_again(sent: list[NDArray[np.uint8]]) -> None:
    first, second = Receiver(1, "video1"), Receiver(1, "video1")
    first.receive(sent, frame=3)
    assert np.array_equal(first.receive(sent, frame=8).picture, second.receive(sent, frame=8).picture)


@pytest.mark.parametrize("sent", [[], [STRIPES], [STRIPES, GRAY]])
def test_another_frame_seed_or_frequency_has_other_noise(sent: list[NDArray[np.uint8]]) -> None:
    picture = Receiver(1, "video1").receive(sent, frame=8).picture
    for other in (
        Receiver(1, "video1").receive(sent, 9),
        Receiver(2, "video1").receive(sent, 8),
        Receiver(1, "video2").receive(sent, 8),
    ):
        assert not np.array_equal(picture, other.picture)


def test_the_sent_picture_is_left_alone() -> None:
    sent = STRIPES.copy()
    Receiver(1, "video1").receive([sent], frame=1).picture[:] = 0
    assert np.array_equal(sent, STRIPES)
