"""Tracks the ball, also through pictures in which it is hidden."""

from mission_control.modules.module import Module
from red_ball.messages import Ball, ColorPicture, Spot


class BallTracker(Module):
    class Inputs(Module.Inputs):
        picture: ColorPicture
        spot: Spot | None = None

    class Outputs(Module.Outputs):
        ball: Ball | None = None

    class Parameters(Module.Parameters, frozen=True):
        forgets_after: int = 10

    parameters: Parameters

    def reset(self) -> None:
        self.ball: Ball | None = None

    def update(self, inputs: Inputs) -> Outputs:
        self.ball = self.foreseen() if inputs.spot is None else self.seen(inputs.spot)
        return self.Outputs(self.ball)

    def foreseen(self) -> Ball | None:
        last = self.ball
        if last is None or last.pictures_ago >= self.parameters.forgets_after:
            return None
        x_px, y_px = last.x_px + last.x_px_a_picture, last.y_px + last.y_px_a_picture
        return Ball(x_px, y_px, last.x_px_a_picture, last.y_px_a_picture, last.pictures_ago + 1)

    def seen(self, spot: Spot) -> Ball:
        last = self.ball
        if last is None:
            return Ball(spot.x_px, spot.y_px, 0.0, 0.0, 0)
        past = last.pictures_ago + 1  # the place was predicted for all of them but one
        x_px_a_picture = last.x_px_a_picture + (spot.x_px - last.x_px - last.x_px_a_picture) / past
        y_px_a_picture = last.y_px_a_picture + (spot.y_px - last.y_px - last.y_px_a_picture) / past
        return Ball(spot.x_px, spot.y_px, x_px_a_picture, y_px_a_picture, 0)
