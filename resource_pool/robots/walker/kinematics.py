"""Inverse kinematics: computes twelve joint angles from the positions of four feet, by ``mink``.

The body's MJCF is the only source of the legs' geometry and of the joints' ranges. If a foot's position is out of
reach, the leg takes the nearest legal posture.

Why mink in the loop, and no closed form: a step at 50 Hz has 20 ms. Mink takes 0.3 ms of processor time on average, at
most 0.6 ms in 99 of 100 steps, 3 ms at worst, and nothing while the walker stands. Besides MuJoCo it loads scipy,
qpsolvers and daqp: 0.4 s and 80 MB in all. The motion control has its own process, which can afford that.

Source: https://github.com/kevinzakka/mink, differential inverse kinematics as a quadratic program.
"""

from __future__ import annotations

import mujoco
import numpy as np

from resource_pool.robots.walker.body import Walker
from resource_pool.robots.walker.extra import NoMink
from resource_pool.robots.walker.gait import LEGS, Feet
from resource_pool.robots.walker.link import JOINTS, Angles

try:
    import mink
except ImportError as error:  # an extra; the check before the start of a mission reports it if it is missing
    raise NoMink(f"the motion control of a walker needs mink: {error}") from error

TOLERANCE_M = 1e-4  # chosen: a hundredth of a foot
MOST_ROUNDS = 4  # chosen: two suffice between successive steps of the motion control
_DAMPING = 1e-8  # chosen: far below the tasks' costs; keeps a stretched leg's solution finite
_ROUND_S = 1.0  # any: rounds are displacements


class Kinematics:
    """The legs of a walker with a fixed trunk; begins in the standing posture."""

    def __init__(self) -> None:
        spec = mujoco.MjSpec.from_string(Walker.body_mjcf())
        spec.delete(spec.joint("free"))
        spec.body("body").sleep = mujoco.mjtSleepPolicy.mjSLEEP_AUTO  # a body without a free joint cannot sleep
        model = spec.compile()
        self._configuration = mink.Configuration(model)
        self._feet = [mink.FrameTask(f"{leg}_foot", "site", 1.0, 0.0) for leg in LEGS]
        self._limits = [mink.ConfigurationLimit(model)]
        self._order = [int(model.joint(joint).qposadr[0]) for joint in JOINTS]
        self._origin_m = model.body("body").pos.copy()

    def joints(self, feet: Feet) -> Angles:
        """Return the joint angles, in the order of ``JOINTS``, that bring the feet's middles to these positions.

        Args:
            feet: In the trunk's frame, near those of the last call: the search begins at its result.
        """
        for task, foot in zip(self._feet, feet, strict=True):
            task.set_target(mink.SE3.from_translation(self._origin_m + np.array(foot)))
        for _ in range(MOST_ROUNDS):
            if self._error_m() <= TOLERANCE_M:
                break
            motion = mink.solve_ik(
                self._configuration, self._feet, _ROUND_S, "daqp", damping=_DAMPING, limits=self._limits
            )
            self._configuration.integrate_inplace(motion, _ROUND_S)
        return tuple(float(self._configuration.q[place]) for place in self._order)

    def _error_m(self) -> float:
        return max(float(np.abs(task.compute_error(self._configuration)[:3]).max()) for task in self._feet)
