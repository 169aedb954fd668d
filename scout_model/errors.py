"""Errors of the simulated hardware. This package does not depend on the bus, so it has its own exception tree."""

from __future__ import annotations

from typing import ClassVar


class ScoutModelError(Exception):
    """Root of everything this package raises on purpose.

    Attributes:
        remedy: Advice for the caller.
    """

    remedy: ClassVar[str]

    def __str__(self) -> str:
        detail = str(self.args[0]) if self.args else type(self).__name__
        return f"{detail} ({self.remedy})"


class UnknownBody(ScoutModelError, KeyError):
    """The world has no body of this name."""

    remedy = "Ask for a Scout or target named in the world's description."


class InvalidWorld(ScoutModelError, ValueError):
    """The description cannot be built."""

    remedy = "Correct the description of the world."


class InvalidRoom(InvalidWorld):
    """The MJCF of the user's room cannot be used."""

    remedy = "Correct the room's MJCF file; 'python -m mujoco.viewer --mjcf=FILE' shows the room in MuJoCo."


class UnstableBody(InvalidWorld):
    """MuJoCo cannot compute the motion of a robot's body."""

    remedy = "Lower the gains of its actuators, limit their forces, or give its light joints an armature."


class MalformedPacket(ScoutModelError, ValueError):
    """These bytes or values do not form a packet of the command radio."""

    remedy = "Build packets with the encode functions of scout_model.radio_link."


class StateMismatch(ScoutModelError, ValueError):
    """The state does not belong to the camera's world."""

    remedy = "Build the camera from the MJCF of the world whose state it shows."


class RenderingUnavailable(ScoutModelError, RuntimeError):
    """OpenGL cannot be used in this process."""

    remedy = "Call scout_model.gl_probe.prepare first, or use the paint backend."
