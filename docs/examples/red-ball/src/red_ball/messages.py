"""The messages between the modules."""

from backbone.ranges import Pixels
from backbone.wire import Message


class ColorPicture(Message, frozen=True):
    """A picture; ``pixels`` has red, green and blue of each pixel, row by row from the top."""

    number: int
    width_px: int
    height_px: int
    pixels: Pixels


class Spot(Message, frozen=True):
    """The middle of all red pixels of a picture."""

    picture: int
    x_px: float
    y_px: float
    size_px: int


class Ball(Message, frozen=True):
    """The place of the ball, and its motion from picture to picture."""

    x_px: float
    y_px: float
    x_px_a_picture: float
    y_px_a_picture: float
    pictures_ago: int
    """Age of the newest spot in pictures; 0: this picture has a spot."""
