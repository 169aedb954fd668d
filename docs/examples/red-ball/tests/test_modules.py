"""Each module by hand, and all of them connected."""

import numpy as np
import pytest

from red_ball.ball_tracker import BallTracker
from red_ball.color_threshold import ColorThreshold
from red_ball.messages import Ball, ColorPicture, Spot
from red_ball.rolling_ball import RollingBall


def picture(*reds, number=1):
    """Return a grey picture of 10 × 10 pixels in which these (row, column) are red."""
    pixels = np.full((10, 10, 3), 90, np.uint8)
    for row, column in reds:
        pixels[row, column] = (220, 40, 30)
    return ColorPicture(number, 10, 10, memoryview(pixels.tobytes()))


def test_the_spot_is_the_middle_of_the_red_pixels(module_under_test):
    threshold = module_under_test(ColorThreshold())
    found = threshold.update(picture=picture((2, 4), (2, 6)))
    assert found == ColorThreshold.Outputs(Spot(1, 5.0, 2.0, 2))
    assert np.count_nonzero(threshold.shown["red"]) == 2


def test_too_few_red_pixels_are_no_spot(module_under_test):
    threshold = module_under_test(ColorThreshold(ColorThreshold.Parameters(least_pixels=3)))
    assert threshold.update(picture=picture((2, 4), (2, 6))) == ColorThreshold.Outputs()


def test_a_hidden_ball_is_foreseen_and_forgotten_in_the_end(module_under_test):
    tracker = module_under_test(BallTracker(BallTracker.Parameters(forgets_after=2)))
    for number, x_px in enumerate((1.0, 3.0), 1):
        tracker.update(picture=picture(number=number), spot=Spot(number, x_px, 5.0, 4))
    hidden = [tracker.update(picture=picture(number=number)).ball for number in (3, 4, 5)]
    assert hidden == [Ball(5.0, 5.0, 2.0, 0.0, 1), Ball(7.0, 5.0, 2.0, 0.0, 2), None]
    tracker.check_reset()


def test_the_tracker_learns_the_speed_of_the_rolling_ball(module_graph):
    graph = module_graph(RollingBall(), ColorThreshold(), BallTracker(), frequency_hz=20.0)
    graph.advance(1.0)
    assert len(graph.made["ball"]) == 20
    assert graph.made["ball"][-1].x_px_a_picture == pytest.approx(2.0)
