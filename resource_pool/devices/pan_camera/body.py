"""The on-board program of a camera that pans.

Rules:

* It pans at ``PAN_RAD_S``. A halt or safe packet stops the pan motor at its present angle.
* If no packet arrives for ``COMMAND_TIMEOUT_S``, the transmitter switches off and the pan motor stops.
"""

from __future__ import annotations

import struct
from importlib import resources

from scout_model import radio_link
from scout_model.dimensions import COMMAND_TIMEOUT_S
from scout_model.errors import MalformedPacket
from scout_model.radio_link import HaltPacket, Safe, TransmitterOff, TransmitterOn

MOST_PAN_RAD = 2.8  # as in body.xml; chosen: 160 degrees, so its cable never winds up
PAN_RAD_S = 1.0  # chosen: a person can follow the picture

_LOOK = struct.Struct("!cf")


def encode_look(pan_rad: float) -> bytes:
    """Return the packet that turns the camera to this angle; left is positive."""
    return _LOOK.pack(b"L", pan_rad)


class PanCamera:
    """The camera as ``scout_model.robot.Robot``."""

    frequency = ""
    """Frequency of its transmitter; empty while it is off."""

    def __init__(self) -> None:
        self._asked_rad = self._pan_rad = 0.0
        self._heard_s = self._now_s = 0.0

    @classmethod
    def body_mjcf(cls) -> str:
        """Return the body; see ``scout_model.robot.Robot``."""
        return resources.files("resource_pool.devices.pan_camera").joinpath("body.xml").read_text(encoding="utf-8")

    @property
    def motors(self) -> float:
        """1 while the camera pans, else 0; panning disturbs its picture."""
        return float(self._asked_rad != self._pan_rad)

    def hear(self, payload: bytes, now_s: float) -> None:
        """Obey one packet; ignore it if it is malformed."""
        try:
            self._obey(payload)
        except (MalformedPacket, struct.error):
            return
        self._heard_s = now_s

    def controls(self, now_s: float) -> dict[str, float]:
        """Advance to this time and return the target angle of the pan motor."""
        past_s, self._now_s = now_s - self._now_s, now_s
        if (self.motors or self.frequency) and now_s - self._heard_s >= COMMAND_TIMEOUT_S:
            self._stop()
            self.frequency = ""
        most_rad = PAN_RAD_S * past_s
        self._pan_rad += max(-most_rad, min(most_rad, self._asked_rad - self._pan_rad))
        return {"pan": self._pan_rad}

    def _obey(self, payload: bytes) -> None:
        if payload[:1] == b"L":
            _, asked_rad = _LOOK.unpack(payload)
            if not -MOST_PAN_RAD <= asked_rad <= MOST_PAN_RAD:  # NaN is rejected, too
                raise MalformedPacket(f"it cannot look to {asked_rad} rad")
            self._asked_rad = asked_rad
            return
        match radio_link.decode(payload):
            case TransmitterOn(frequency):
                self.frequency = frequency
            case TransmitterOff():
                self.frequency = ""
            case HaltPacket():
                self._stop()
            case Safe():
                self._stop()
                self.frequency = ""
            case other:
                raise MalformedPacket(f"a camera has no command {type(other).__name__}")

    def _stop(self) -> None:
        self._asked_rad = self._pan_rad
