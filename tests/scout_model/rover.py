"""A robot of another kind, as a user would add it: a box on two wheels that receives the Scouts' packets."""

from __future__ import annotations

from scout_model import radio_link
from scout_model.errors import MalformedPacket

RADIUS_M = 0.05


class Rover:
    """A box on two driven wheels and a ball, with a camera in front."""

    def __init__(self) -> None:
        self._speeds_rad_s = (0.0, 0.0)
        self._frequency = ""

    @classmethod
    def body_mjcf(cls) -> str:
        return """
        <mujoco model="rover">
          <worldbody>
            <body name="body" pos="0 0 0.05" sleep="allowed">
              <freejoint name="free"/>
              <geom name="hull" type="box" size="0.1 0.06 0.03" mass="1.0" group="2"/>
              <geom name="ball" type="sphere" pos="-0.08 0 -0.03" size="0.02" friction="0.01" priority="3" group="2"/>
              <camera name="camera" pos="0.11 0 0.02" xyaxes="0 -1 0 0 0 1" fovy="40"/>
              <body name="left" pos="0.03 0.08 0">
                <joint name="left" axis="0 1 0" armature="1e-4" frictionloss="1e-3"/>
                <geom name="left" type="ellipsoid" size="0.05 0.01 0.05" mass="0.05" group="2"/>
              </body>
              <body name="right" pos="0.03 -0.08 0">
                <joint name="right" axis="0 1 0" armature="1e-4" frictionloss="1e-3"/>
                <geom name="right" type="ellipsoid" size="0.05 0.01 0.05" mass="0.05" group="2"/>
              </body>
            </body>
          </worldbody>
          <actuator>
            <velocity name="left" joint="left" kv="0.2" forcerange="-0.3 0.3"/>
            <velocity name="right" joint="right" kv="0.2" forcerange="-0.3 0.3"/>
          </actuator>
        </mujoco>
        """

    @property
    def frequency(self) -> str:
        return self._frequency

    @property
    def motors(self) -> float:
        return min(1.0, max(map(abs, self._speeds_rad_s)) / 10.0)

    def hear(self, payload: bytes, now_s: float) -> None:
        try:
            packet = radio_link.decode(payload)
        except MalformedPacket:
            return
        match packet:
            case radio_link.DrivePacket(left_rad_s, right_rad_s):
                self._speeds_rad_s = left_rad_s, right_rad_s
            case radio_link.TransmitterOn(frequency):
                self._frequency = frequency
            case radio_link.TransmitterOff():
                self._frequency = ""
            case radio_link.HaltPacket() | radio_link.JumpPacket():  # it has no foot to jump with
                self._speeds_rad_s = 0.0, 0.0
            case radio_link.Safe():
                self._speeds_rad_s, self._frequency = (0.0, 0.0), ""

    def controls(self, now_s: float) -> dict[str, float]:
        return dict(zip(("left", "right"), self._speeds_rad_s, strict=True))


class Driverless(Rover):
    """Drives an actuator that its body has not."""

    def controls(self, now_s: float) -> dict[str, float]:
        return {"rudder": 1.0}


class Broken(Rover):
    """Its body is no MJCF."""

    @classmethod
    def body_mjcf(cls) -> str:
        return "<mujoco><worldbody><body/></mujoco>"


class Bodiless:
    """Is no robot."""


class Confused(Rover):
    """Sets an actuator to what no motor can do, as a division of infinities does."""

    gives = float("nan")

    def controls(self, now_s: float) -> dict[str, float]:
        return {**super().controls(now_s), "left": self.gives}


class Trembling(Rover):
    """One motor is far too strong for its light wheel."""

    @classmethod
    def body_mjcf(cls) -> str:
        calm = '<velocity name="right" joint="right" kv="0.2" forcerange="-0.3 0.3"/>'
        return super().body_mjcf().replace(calm, '<motor name="right" joint="right" gear="1e5"/>')
