"""Camera pictures without OpenGL: the painter's algorithm on OpenCV polygons.

Geoms are converted to convex polygons once. For each picture the painter projects them, drops the polygons that face
away, and paints the rest from far to near, shaded by the model's lights. Order of painting:

1. floor and walls (geom group 0), behind everything because the camera is inside the room,
2. marks on them (group 1),
3. things (group 2), body by body; a body's marks right after the body.

An axis-aligned plane between two bounding boxes decides which body is in front. Distance would be wrong: a body behind
the far end of a long table may be nearer than the table's middle.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from scout_model.dimensions import PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX

_Floats = NDArray[np.float64]

_SLICES = 16  # chosen: as for the OpenGL renderer in room.xml
_STACKS = 8  # chosen: same
_FLOOR_REACH_M = 100.0  # chosen: size of an endless plane, beyond every room
_SOLIDS_KEPT = 512  # chosen: meshes of a few worlds, some kilobytes each
_NEAR_M = 0.02  # chosen: as in room.xml
_SUBPIXEL_BITS = 4  # chosen: edges move smoothly, a sixteenth of a pixel at a time
_DISC_M = 0.002  # chosen: a mark is a disc on a surface, not a band around a body, if half its length is no more
_FARTHEST_PX = 1e6  # chosen: fits OpenCV's fixed-point coordinates
_ROOM, _MARKS, _THINGS = 0, 1, 2  # geom groups, see room.xml
_LUMA = np.array([0.299, 0.587, 0.114])  # as OpenCV's RGB to gray
_UNPAINTED = (int(mujoco.mjtGeom.mjGEOM_HFIELD), int(mujoco.mjtGeom.mjGEOM_SDF))


def _is_seen(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Return which geoms a picture may show: MuJoCo leaves out those without any opacity."""
    return np.asarray((model.geom_group <= _THINGS) & (model.geom_rgba[:, 3] > 0), bool)


def only_opengl_shows(model: mujoco.MjModel) -> list[str]:
    """Return what a picture of this model has by OpenGL and would lack by the painter; empty: nothing."""
    seen = _is_seen(model)
    sun = int(mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
    parts = {
        "height fields and signed distance fields": np.isin(model.geom_type[seen], _UNPAINTED).any(),
        "materials": (model.geom_matid[seen] >= 0).any(),
        "transparent geoms": (model.geom_rgba[seen, 3] < 1).any(),
        "lamps": (model.light_type != sun).any() or np.any(model.vis.headlight.diffuse),
        "sites": ((model.site_group <= _THINGS) & (model.site_rgba[:, 3] > 0)).any(),
        "tendons": (model.tendon_group <= _THINGS).any(),
        "skins and soft bodies": model.nskin + model.nflex > 0,
    }
    return [part for part, is_there in parts.items() if is_there]


@dataclass(frozen=True, slots=True)
class _Mesh:
    """A geom as convex polygons in its own frame: corners (n, 3), and each polygon's corners and normal."""

    corners: _Floats
    polygons: list[NDArray[np.intp]]
    normals: _Floats


class Painter:
    """Pictures of one model."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        geoms = np.flatnonzero(_is_seen(model)).tolist()
        meshes = [_mesh(model, geom) for geom in geoms]
        self._geoms = np.array(geoms)
        self._groups = model.geom_group[self._geoms]
        self._bodies = model.body_rootid[model.geom_bodyid[self._geoms]]
        self._corners = np.concatenate([mesh.corners for mesh in meshes])
        self._geom_of_corner = np.repeat(np.arange(len(meshes)), [len(mesh.corners) for mesh in meshes])
        self._normals = np.concatenate([mesh.normals for mesh in meshes])
        self._geom_of_polygon = np.repeat(np.arange(len(meshes)), [len(mesh.polygons) for mesh in meshes])
        first_corner = np.cumsum([0, *(len(mesh.corners) for mesh in meshes)])
        self._polygons = [
            polygon + first_corner[number] for number, mesh in enumerate(meshes) for polygon in mesh.polygons
        ]
        self._begins = np.cumsum([0, *(len(polygon) for polygon in self._polygons)])[:-1]
        self._corners_in_turn = np.concatenate(self._polygons)
        self._a_corner = self._corners_in_turn[self._begins]
        self._polygons_of_geom = [np.flatnonzero(self._geom_of_polygon == geom) for geom in range(len(geoms))]
        self._background = [geom for group in (_ROOM, _MARKS) for geom in self._of_room(group)]
        self._room_geoms = self._geoms[self._background]
        self._things = self._group_things()
        self._remembered: dict[int, tuple[bytes, NDArray[np.uint8]]] = {}

    def draw(self, data: mujoco.MjData, camera: int) -> NDArray[np.uint8]:
        """Return the picture: grey levels 0 to 255, shape (240, 320), row 0 on top."""
        rotations = data.geom_xmat[self._geoms].reshape(-1, 3, 3)
        corners = np.einsum("nij,nj->ni", rotations[self._geom_of_corner], self._corners)
        corners += data.geom_xpos[self._geoms][self._geom_of_corner]
        normals = np.einsum("nij,nj->ni", rotations[self._geom_of_polygon], self._normals)
        eye_m = data.cam_xpos[camera]
        view = _View(eye_m, data.cam_xmat[camera].reshape(3, 3), float(self._model.cam_fovy[camera]), corners)
        # Read from the model for each picture, because colors change in a dark place.
        colors = 255 * self._model.geom_rgba[self._geoms, :3] @ _LUMA
        levels = np.clip(colors[self._geom_of_polygon] * self._brightness(data, normals), 0, 255)
        is_ahead = view.is_ahead[self._corners_in_turn]
        is_whole = np.logical_and.reduceat(is_ahead, self._begins)
        faces = np.einsum("ni,ni->n", normals, eye_m - corners[self._a_corner]) > 0
        is_seen = faces & np.logical_or.reduceat(is_ahead, self._begins)
        canvas = self._background_as_before(data, camera)
        is_new = canvas is None
        if canvas is None:
            canvas = np.zeros((PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX), np.uint8)

        def paint(geom: int) -> None:
            of_geom = self._polygons_of_geom[geom]
            for polygon in of_geom[is_seen[of_geom]].tolist():
                view.fill(canvas, self._polygons[polygon], float(levels[polygon]), is_whole=bool(is_whole[polygon]))

        if is_new:
            for geom in self._background:
                paint(geom)
            self._remembered[camera] = self._background_key(data, camera), canvas.copy()
        own_body = self._model.body_rootid[self._model.cam_bodyid[camera]]
        # A body outside the picture must not affect the order either, because the cache key ignores it.
        others = [
            thing
            for thing in self._things
            if self._bodies[thing.solids[0]] != own_body and not view.is_beside(thing.corners)
        ]
        boxes = [thing.bounds(corners) for thing in others]
        for number in _far_to_near(np.array([low for low, _ in boxes]), np.array([high for _, high in boxes]), eye_m):
            thing = others[number]
            centres_m = data.geom_xpos[self._geoms[thing.solids]]
            for solid in np.argsort(-np.linalg.norm(centres_m - eye_m, axis=1), kind="stable"):
                paint(thing.solids[solid])
            for mark in thing.marks:
                paint(mark)
        return canvas

    def close(self) -> None:
        """Do nothing: OpenCV holds no resources."""

    def _background_as_before(self, data: mujoco.MjData, camera: int) -> NDArray[np.uint8] | None:
        """Return a copy of this camera's last background; None if the room would look different now."""
        key, picture = self._remembered.get(camera, (b"", None))
        return picture.copy() if picture is not None and key == self._background_key(data, camera) else None

    def _background_key(self, data: mujoco.MjData, camera: int) -> bytes:
        """Return a cache key for the room: camera, lights and colors; the room itself does not move."""
        seen = (data.cam_xpos[camera], data.cam_xmat[camera], data.light_xdir, self._model.geom_rgba[self._room_geoms])
        return b"".join(part.tobytes() for part in seen)

    def _of_room(self, group: int) -> list[int]:
        return [int(geom) for geom in np.flatnonzero((self._groups == group) & (self._bodies == 0))]

    def _group_things(self) -> list[_Thing]:
        furniture = [[geom] for geom in self._of_room(_THINGS)]
        moving = [
            [int(geom) for geom in np.flatnonzero((self._bodies == body) & (self._groups == _THINGS))]
            for body in sorted(set(self._bodies.tolist()) - {0})
        ]
        return [self._thing(solids) for solids in (*furniture, *moving) if solids]

    def _thing(self, solids: list[int]) -> _Thing:
        body = self._bodies[solids[0]]
        # The marks of the room's own body are on its walls and painted before all things.
        marks = np.flatnonzero((self._bodies == body) & (self._groups == _MARKS) & (body != 0))
        return _Thing(
            solids=np.array(solids),
            marks=[int(mark) for mark in marks],
            corners=np.flatnonzero(np.isin(self._geom_of_corner, solids)),
        )

    def _brightness(self, data: mujoco.MjData, normals: _Floats) -> _Floats:
        """Return the brightness of each polygon as a share of its color, by OpenGL's fixed lighting model."""
        model = self._model
        brightness: _Floats = np.full(len(normals), float(model.vis.headlight.ambient @ _LUMA))
        for light in range(model.nlight):
            slant = np.maximum(0.0, -(normals @ data.light_xdir[light]))
            brightness += model.light_ambient[light] @ _LUMA + slant * float(model.light_diffuse[light] @ _LUMA)
        return brightness


@dataclass(frozen=True, slots=True)
class _Thing:
    """A unit of painting: the geoms of one body, and the corners of their bounding box."""

    solids: NDArray[np.intp]
    marks: list[int]
    corners: NDArray[np.intp]

    def bounds(self, corners: _Floats) -> tuple[_Floats, _Floats]:
        own = corners[self.corners]
        return own.min(axis=0), own.max(axis=0)


class _View:
    """A pinhole camera: world corners in its frame (x right, y up, z ahead), and on the picture."""

    def __init__(self, eye_m: _Floats, axes: _Floats, vertical_view_deg: float, corners: _Floats) -> None:
        self._focal_px = PICTURE_HEIGHT_PX / 2 / math.tan(math.radians(vertical_view_deg) / 2)
        self._corners: _Floats = (corners - eye_m) @ axes
        self._corners[:, 2] *= -1
        self.is_ahead = self._corners[:, 2] >= _NEAR_M
        right, up, ahead = self._corners.T
        # A line is drawn up to a pixel wider than its true width.
        across, upwards = ((size / 2 + 2) / self._focal_px * ahead for size in (PICTURE_WIDTH_PX, PICTURE_HEIGHT_PX))
        self._is_out = np.stack([~self.is_ahead, right > across, right < -across, up > upwards, up < -upwards])
        self._pixels = self._project(np.where(self.is_ahead[:, np.newaxis], self._corners, 1.0))

    def is_beside(self, corners: NDArray[np.intp]) -> bool:
        """Return whether all these corners are behind the camera or beyond the same edge of the picture."""
        return bool(self._is_out[:, corners].all(axis=1).any())

    def fill(self, canvas: NDArray[np.uint8], polygon: NDArray[np.intp], level: float, *, is_whole: bool) -> None:
        """Paint the polygon, as far as it lies before the camera, with this grey level.

        Args:
            is_whole: All of its corners are ahead; else some are.
        """
        pixels = self._pixels[polygon] if is_whole else self._project(_clip_near(self._corners[polygon]))
        # Edges without anti-aliasing, as the OpenGL pictures have them.
        cv2.fillConvexPoly(canvas, pixels, level, cv2.LINE_8, _SUBPIXEL_BITS)

    def _project(self, corners: _Floats) -> NDArray[np.int32]:
        scale = self._focal_px / corners[:, 2]
        # In OpenCV an integer coordinate is the middle of a pixel.
        columns = PICTURE_WIDTH_PX / 2 - 0.5 + corners[:, 0] * scale
        rows = PICTURE_HEIGHT_PX / 2 - 0.5 - corners[:, 1] * scale
        pixels = np.clip(np.stack([columns, rows], axis=1), -_FARTHEST_PX, _FARTHEST_PX)
        return np.rint(pixels * (1 << _SUBPIXEL_BITS)).astype(np.int32)


def _clip_near(corners: _Floats) -> _Floats:
    """Return the part of a convex polygon beyond the near plane; at least one corner must be beyond it."""
    kept: list[_Floats] = []
    for here, there in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if here[2] >= _NEAR_M:
            kept.append(here)
        if (here[2] >= _NEAR_M) != (there[2] >= _NEAR_M):
            kept.append(here + (there - here) * ((_NEAR_M - here[2]) / (there[2] - here[2])))
    return np.array(kept)


def _far_to_near(lows: _Floats, highs: _Floats, eye_m: _Floats) -> list[int]:
    """Return an order in which no box is painted over by a box behind it, if such an order exists.

    Args:
        lows: Least corner of each box, shape (n, 3).
        highs: Greatest corner of each box.
        eye_m: Position of the camera.
    """
    if len(lows) == 0:
        return []
    above = lows[:, np.newaxis] >= highs[np.newaxis]  # [i, j, axis]: a plane across the axis has i above and j below
    is_nearer = (above & (eye_m >= lows)[:, np.newaxis]).any(axis=2)
    is_nearer |= (above.transpose(1, 0, 2) & (eye_m <= highs)[:, np.newaxis]).any(axis=2)
    hides: NDArray[np.bool_] = np.asarray(is_nearer & ~is_nearer.T, bool)
    distances_m = np.linalg.norm((lows + highs) / 2 - eye_m, axis=1)
    left = [int(number) for number in np.argsort(-distances_m, kind="stable")]
    order: list[int] = []
    while left:
        # Boxes can hide each other in a cycle; then distance decides.
        free = next((number for number in left if not hides[number, left].any()), left[0])
        left.remove(free)
        order.append(free)
    return order


def _mesh(model: mujoco.MjModel, geom: int) -> _Mesh:
    kind = mujoco.mjtGeom(model.geom_type[geom])
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        return _triangles(model, int(model.geom_dataid[geom]))
    x_m, y_m, z_m = model.geom_size[geom].tolist()
    mesh = _solid(kind, (x_m, y_m, z_m), is_mark=bool(model.geom_group[geom] == _MARKS))
    if mesh is None:
        raise ValueError(f"geom {model.geom(geom).name!r} has shape {kind.name}, which the painter cannot draw")
    return mesh


@functools.lru_cache(maxsize=_SOLIDS_KEPT)
def _solid(kind: mujoco.mjtGeom, size_m: tuple[float, float, float], *, is_mark: bool) -> _Mesh | None:
    """Return a shape of this size, read-only; None: the kind is unknown."""
    match kind:
        case mujoco.mjtGeom.mjGEOM_PLANE:
            reach = _FLOOR_REACH_M
            flat = [[-reach, -reach, 0], [reach, -reach, 0], [reach, reach, 0], [-reach, reach, 0]]
            return _polyhedron(np.array(flat, float), [[0, 1, 2, 3]])
        case mujoco.mjtGeom.mjGEOM_BOX:
            signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
            sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
            if is_mark:
                # OpenCV also paints a polygon's outline, so a mark's thin edges would become lines.
                thin = 2 * size_m.index(min(size_m))
                sides = sides[thin : thin + 2]
            return _polyhedron(signs * np.array(size_m), sides)
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            if is_mark and size_m[1] <= _DISC_M:
                return _disc(size_m[0], size_m[1])
            return _cylinder(size_m[0], size_m[1], has_lids=not is_mark)
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            return _sphere(np.repeat(size_m[0], 3), 0.0)
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            return _sphere(np.array(size_m), 0.0)
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            return _sphere(np.repeat(size_m[0], 3), size_m[1])
    return None


def _polyhedron(corners: _Floats, polygons: list[list[int]]) -> _Mesh:
    """Return the mesh; the corners of each polygon run counter-clockwise seen from outside."""
    normals = []
    for polygon in polygons:
        # The first corner of a sphere's polygon is doubled at the poles.
        a, b, c = corners[polygon[0 if len(polygon) == 3 else -1]], corners[polygon[1]], corners[polygon[2]]
        normal = np.cross(b - a, c - a)
        normals.append(normal / np.linalg.norm(normal))
    return _Mesh(corners, [np.array(polygon) for polygon in polygons], np.array(normals))


def _cylinder(radius_m: float, half_length_m: float, *, has_lids: bool) -> _Mesh:
    """Return a cylinder along z. A band that marks a body has no lids, because they would cover things on the body."""
    angles = 2 * np.pi * np.arange(_SLICES) / _SLICES
    ring = np.stack([radius_m * np.cos(angles), radius_m * np.sin(angles)], axis=1)
    levels_m = np.repeat([-half_length_m, half_length_m], _SLICES)[:, np.newaxis]
    corners = np.concatenate([np.concatenate([ring, ring]), levels_m], axis=1)
    n = _SLICES
    polygons = [[i, (i + 1) % n, n + (i + 1) % n, n + i] for i in range(n)]
    if has_lids:
        polygons += [list(range(n - 1, -1, -1)), list(range(n, 2 * n))]
    return _polyhedron(corners, polygons)


def _disc(radius_m: float, half_length_m: float) -> _Mesh:
    """Return the lid of a flat cylinder: a mark is visible from the same side as its surface."""
    angles = 2 * np.pi * np.arange(_SLICES) / _SLICES
    ring = [[radius_m * math.cos(angle), radius_m * math.sin(angle), half_length_m] for angle in angles]
    return _polyhedron(np.array(ring), [list(range(_SLICES))])


def _triangles(model: mujoco.MjModel, mesh: int) -> _Mesh:
    first, faces = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    corners = model.mesh_vert[first : first + model.mesh_vertnum[mesh]].astype(np.float64)
    polygons = model.mesh_face[faces : faces + model.mesh_facenum[mesh]]
    return _polyhedron(corners, polygons.tolist())


def _sphere(radii_m: _Floats, half_length_m: float) -> _Mesh:
    """Return an ellipsoid, or with a length between its halves a capsule along z."""
    n = _SLICES
    latitudes = np.pi * (np.arange(_STACKS + 1) / _STACKS - 0.5)
    angles = 2 * np.pi * np.arange(n) / n
    corners = radii_m * np.array(
        [[np.cos(up) * np.cos(a), np.cos(up) * np.sin(a), np.sin(up)] for up in latitudes for a in angles]
    )
    corners[:, 2] += np.sign(corners[:, 2].round(12)) * half_length_m
    polygons = [
        [row * n + i, row * n + (i + 1) % n, (row + 1) * n + (i + 1) % n, (row + 1) * n + i]
        for row in range(_STACKS)
        for i in range(n)
    ]
    return _polyhedron(corners, polygons)
