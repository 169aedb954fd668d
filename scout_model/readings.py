"""The sensors of the robots' bodies: passes readings from MuJoCo's array to the on-board programs.

Sensors cost time and change no motion. So they are computed only in the last step of a frame, and never in a world
without a ``FeelingRobot``. A reading shows the moment before that step.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from scout_model.robot import FeelingRobot, Robot, feeling


class Senses:
    """The sensors of all feeling robots; the constructor passes the present readings to each robot once."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, programs: Mapping[str, Robot]) -> None:
        self._model, self._data, self._option = model, data, model.opt
        sensors = parts_by_robot(model.sensor(sensor).name for sensor in range(model.nsensor))
        self._bodies = [
            _BodySenses(model, sensors[name], feels)
            for name, program in programs.items()
            if (feels := feeling(program)) is not None and name in sensors
        ]
        self._felt = b""
        self.update(0.0)
        self._on = int(self._option.disableflags)
        self._off = self._on | int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
        self._option.disableflags = self._off

    def step(self) -> None:
        """Advance the world by one step, and compute the sensor readings at the beginning of the step."""
        if not self._bodies:
            mujoco.mj_step(self._model, self._data)
            return
        self._option.disableflags = self._on
        mujoco.mj_step(self._model, self._data)
        self._option.disableflags = self._off

    def update(self, now_s: float) -> None:
        """Pass the readings to each robot, unless all its readings are unchanged."""
        if not self._bodies:
            return
        readings = self._data.sensordata
        raw = readings.tobytes()
        if raw == self._felt:
            return
        self._felt = raw
        for body in self._bodies:
            body.update(readings, now_s)


def parts_by_robot(names: Iterable[str]) -> dict[str, dict[str, int]]:
    """Return the numbers of the parts of each robot: robot → part → place of ``robot/part`` among the names.

    Example:
        >>> parts_by_robot(["a/left", "a/arm/tip", "clock", "b/left"])
        {'a': {'left': 0, 'arm/tip': 1}, 'b': {'left': 3}}
    """
    parts: defaultdict[str, dict[str, int]] = defaultdict(dict)
    for number, name in enumerate(names):
        robot, slash, part = name.partition("/")
        if slash:
            parts[robot][part] = number
    return dict(parts)


class _BodySenses:
    """Places of one robot's readings in MuJoCo's array."""

    def __init__(self, model: mujoco.MjModel, sensors: Mapping[str, int], program: FeelingRobot) -> None:
        begins, numbers = model.sensor_adr, model.sensor_dim
        own = {name: (int(begins[sensor]), int(begins[sensor] + numbers[sensor])) for name, sensor in sensors.items()}
        first = min(begin for begin, _ in own.values())
        self._part = slice(first, max(end for _, end in own.values()))
        self._numbers = {name: slice(begin - first, end - first) for name, (begin, end) in own.items()}
        self._program = program
        self._felt = b""

    def update(self, readings: NDArray[np.float64], now_s: float) -> None:
        own = readings[self._part]
        raw = own.tobytes()
        if raw == self._felt:
            return
        self._felt = raw
        numbers = own.tolist()
        self._program.feel({name: numbers[where] for name, where in self._numbers.items()}, now_s)
