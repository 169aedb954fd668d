"""Pictures of a red ball that rolls over a grey table and enters again on the left."""

import numpy as np

from mission_control.modules.module import Module
from red_ball.messages import ColorPicture

TABLE, BALL = (90, 90, 90), (220, 40, 30)  # red, green, blue


class RollingBall(Module):
    class Outputs(Module.Outputs):
        picture: ColorPicture

    class Parameters(Module.Parameters, frozen=True):
        width_px: int = 64
        height_px: int = 48
        radius_px: float = 4.0
        speed_px: float = 2.0

    parameters: Parameters

    def reset(self) -> None:
        self.number = 0

    def update(self, inputs: Module.Inputs) -> Outputs:
        given = self.parameters
        x_px = (self.number * given.speed_px) % given.width_px
        rows, columns = np.mgrid[: given.height_px, : given.width_px]
        is_ball = (columns - x_px) ** 2 + (rows - given.height_px / 2) ** 2 <= given.radius_px**2
        pixels = np.where(is_ball[..., np.newaxis], BALL, TABLE).astype(np.uint8)
        self.number += 1
        picture = ColorPicture(self.number, given.width_px, given.height_px, memoryview(pixels.tobytes()))
        return self.Outputs(picture)
