"""Finds the pixels that are red enough, and their middle."""

import numpy as np

from mission_control.modules.module import Module
from red_ball.messages import ColorPicture, Spot


class ColorThreshold(Module):
    class Inputs(Module.Inputs):
        picture: ColorPicture

    class Outputs(Module.Outputs):
        spot: Spot | None = None

    class Parameters(Module.Parameters, frozen=True):
        redder_by: int = 80
        least_pixels: int = 1

    parameters: Parameters

    def update(self, inputs: Inputs) -> Outputs:
        picture = inputs.picture
        colors = np.frombuffer(picture.pixels, np.uint8).reshape(picture.height_px, picture.width_px, 3).astype(int)
        is_red = colors[..., 0] - colors[..., 1:].max(axis=-1) >= self.parameters.redder_by
        self.debug.picture("red", lambda: (is_red * 255).astype(np.uint8))
        rows, columns = np.nonzero(is_red)
        if len(rows) < max(1, self.parameters.least_pixels):
            return self.Outputs()
        return self.Outputs(Spot(picture.number, float(columns.mean()), float(rows.mean()), len(rows)))
