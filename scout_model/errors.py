"""Errors of the simulated hardware. This package does not depend on the bus, so it has its own exception tree."""

from __future__ import annotations

from typing import ClassVar


class ScoutModelError(Exception):
    """Root of everything this package raises on purpose.

    Attributes:
        code: Stable word for machines, ``subject.reason``.
        remedy: Advice for the caller.
    """

    code: ClassVar[str] = "scout_model"
    remedy: ClassVar[str] = ""

    def __str__(self) -> str:
        detail = str(self.args[0]) if self.args else self.code
        return f"{detail} ({self.remedy})" if self.remedy else detail


class UnknownBody(ScoutModelError, KeyError):
    """The world has no body of this name."""

    code = "world.unknown_body"
    remedy = "Ask for a Scout or target named in the world's description."


class InvalidWorld(ScoutModelError, ValueError):
    """The description cannot be built."""

    code = "world.invalid"
    remedy = "Correct the description of the world."


class InvalidRoom(InvalidWorld):
    """The MJCF of the user's room cannot be used."""

    code = "world.room"
    remedy = "Correct the room's MJCF file; 'python -m mujoco.viewer --mjcf=FILE' shows the room in MuJoCo."


class UnstableBody(InvalidWorld):
    """MuJoCo cannot compute the motion of a robot's body."""

    code = "world.unstable"
    remedy = "Lower the gains of its actuators, limit their forces, or give its light joints an armature."


class MalformedPacket(ScoutModelError, ValueError):
    """These bytes or values do not form a packet of the command radio."""

    code = "radio.malformed"
    remedy = "Build packets with the encode functions of scout_model.radio_link."


class StateMismatch(ScoutModelError, ValueError):
    """The state does not belong to the camera's world."""

    code = "camera.state"
    remedy = "Build the camera from the MJCF of the world whose state it shows."


class RenderingUnavailable(ScoutModelError, RuntimeError):
    """OpenGL cannot be used in this process."""

    code = "camera.no_gl"
    remedy = "Call scout_model.gl_probe.prepare first, or use the paint backend."
