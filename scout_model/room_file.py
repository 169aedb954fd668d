"""The user's own room, from one MJCF file.

The bodies of the file replace walls and marks; a plane in it replaces the floor, a light in it replaces the sun.
Settings of the simulation, such as ``<option>``, are ignored. In the world's model the room's names begin with
``room/``.
"""

from __future__ import annotations

import mujoco

from scout_model.errors import InvalidRoom

_SHOWN = {
    mujoco.mjtGeom.mjGEOM_PLANE,
    mujoco.mjtGeom.mjGEOM_SPHERE,
    mujoco.mjtGeom.mjGEOM_CAPSULE,
    mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    mujoco.mjtGeom.mjGEOM_CYLINDER,
    mujoco.mjtGeom.mjGEOM_BOX,
    mujoco.mjtGeom.mjGEOM_MESH,
}
_ROOM, _THINGS = 0, 2  # geom groups, see room.xml


def add_room(spec: mujoco.MjSpec, mjcf: str) -> None:
    """Add the user's room to a world that has only a floor and a sun.

    Args:
        spec: MuJoCo's specification of the world.
        mjcf: The room, without references to other files.

    Raises:
        InvalidRoom: MuJoCo cannot read or build the room, or it has shapes that no camera draws.
    """
    if "<mujoco" not in mjcf:
        raise InvalidRoom("the room's file is no MJCF: it has no <mujoco>")
    try:
        room = mujoco.MjSpec.from_string(mjcf)
    except ValueError as error:
        raise InvalidRoom(f"MuJoCo cannot read the room's MJCF: {error}") from error
    for mesh in (*room.meshes, *room.textures, *room.hfields, *room.skins):
        if getattr(mesh, "file", ""):
            raise InvalidRoom(f"the room's MJCF needs the file {mesh.file!r}; write what is in it into the MJCF")
    try:
        room.copy().compile()
    except ValueError as error:
        raise InvalidRoom(f"MuJoCo cannot build the room: {error}") from error
    for geom in room.geoms:
        if geom.type not in _SHOWN:
            raise InvalidRoom(f"no camera draws the room's geom {geom.name!r}; use boxes, cylinders or meshes")
        # A geom without a group is in MuJoCo's group 0, which is painted behind everything.
        if geom.group == _ROOM and geom.type != mujoco.mjtGeom.mjGEOM_PLANE:
            geom.group = _THINGS
    if any(geom.type == mujoco.mjtGeom.mjGEOM_PLANE for geom in room.geoms):
        spec.delete(spec.geom("floor"))
    if room.lights:
        spec.delete(spec.light("sun"))
    room.option, room.visual, room.stat = spec.option, spec.visual, spec.stat
    spec.attach(room, prefix="room/", frame=spec.worldbody.add_frame())
