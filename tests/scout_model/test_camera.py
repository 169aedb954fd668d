import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from scout_model.camera import Camera
from scout_model.description import Furniture, RobotPlace, Target, WorldDescription
from scout_model.errors import RenderingUnavailable, StateMismatch, UnknownBody
from scout_model.gl_probe import GlSupport, probe
from scout_model.world import World

Picture = NDArray[np.uint8]
NORTH = math.pi / 2


def room(*targets: Target, furniture: list[Furniture] | None = None) -> World:
    """The room of the published experiments, with two Scouts watching the path at y = 3."""
    places = [RobotPlace("scout1", 1, 0.72, 1.764, NORTH), RobotPlace("scout2", 2, 7.20, 0.527, NORTH)]
    return World(WorldDescription(9.0, 6.0, 1, furniture or [], places, list(targets)))


def changed(a: Picture, b: Picture) -> int:
    """Pixels that differ clearly."""
    return int((np.abs(a.astype(int) - b) > 40).sum())


@pytest.fixture(scope="module")
def gl() -> GlSupport:
    return probe()


def views(backend: str, folder: Path, *options: str) -> dict[str, Picture]:
    program, file = Path(__file__).with_name("camera_views.py"), folder / f"{backend}.npz"
    subprocess.run([sys.executable, str(program), backend, str(file), *options], check=True, timeout=60)
    with np.load(file) as pictures:
        return {name: pictures[name] for name in pictures.files}


def test_the_pioneer_is_seen_while_it_crosses_and_not_otherwise() -> None:
    """Path y = 3 from x = 0 to 9 at 0.5 m/s: before Scout 1 at 1.4 s, before Scout 2 at 14.4 s."""
    pioneer = Target("pioneer", "pioneer", [(0.0, 3.0), (9.0, 3.0)], 0.5)
    world, seen = room(pioneer), {}
    with Camera(world.mjcf, "paint") as camera:
        for _ in range(450):
            world.step_frame()
            if world.frame in (43, 225, 432):
                camera.show(world.state())
                seen[world.frame] = {robot: camera.picture(robot) for robot in ("scout1", "scout2")}
    between = seen[225]
    assert changed(seen[43]["scout1"], between["scout1"]) > 4000
    assert changed(seen[43]["scout2"], between["scout2"]) == 0
    assert changed(seen[432]["scout2"], between["scout2"]) > 1000
    assert changed(seen[432]["scout1"], between["scout1"]) == 0


def test_a_thing_before_another_hides_it_and_never_the_other_way() -> None:
    pioneer = Target("pioneer", "pioneer", [(0.72, 3.0), (0.72, 5.0)], 0.5, begin_s=100.0)
    before = Furniture("board", 1.2, 2.4, 3.0, 0.1, 1.0)
    behind = Furniture("board", 1.2, 3.6, 3.0, 0.1, 1.0)
    pictures = []
    for furniture, targets in (([before], [pioneer]), ([before], []), ([behind], [pioneer]), ([behind], [])):
        with Camera(room(*targets, furniture=furniture).mjcf, "paint") as camera:
            pictures.append(camera.picture("scout1"))
    assert changed(pictures[0], pictures[1]) == 0
    assert changed(pictures[2], pictures[3]) > 4000


def test_a_person_is_seen_as_walking_legs() -> None:
    world = room(Target("person", "person", [(5.0, 3.0), (9.0, 3.0)], 1.2))
    with Camera(world.mjcf, "paint") as camera:
        away = camera.picture("scout2")
        for _ in range(55):
            world.step_frame()
        camera.show(world.state())
        assert changed(camera.picture("scout2"), away) > 3000


def test_a_standing_scene_gives_the_same_picture_again() -> None:
    world = room()
    with Camera(world.mjcf, "paint") as one, Camera(world.mjcf, "paint") as other:
        assert np.array_equal(one.picture("scout1"), other.picture("scout1"))


def test_turning_the_scout_turns_its_view() -> None:
    places = [RobotPlace("scout1", 1, 0.72, 1.764, NORTH + turn) for turn in (0.0, 0.1)]
    pictures = []
    for place in places:
        with Camera(World(WorldDescription(9.0, 6.0, 1, robots=[place])).mjcf, "paint") as camera:
            pictures.append(camera.picture("scout1"))
    assert changed(*pictures) > 1000


def test_a_state_of_another_world_is_refused() -> None:
    world = room()
    with Camera(world.mjcf, "paint") as camera, pytest.raises(StateMismatch):
        camera.show(world.state()[:-1])


def test_a_robot_of_another_world_is_refused() -> None:
    with Camera(room().mjcf, "paint") as camera, pytest.raises(UnknownBody):
        camera.picture("scout9")


def test_a_process_not_prepared_for_opengl_is_told_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    with pytest.raises(RenderingUnavailable, match="prepare"):
        Camera(room().mjcf, "gl")


@pytest.mark.processes
def test_opengl_is_loaded_also_after_mujoco(gl: GlSupport, tmp_path: Path) -> None:
    """A zygote has imported mujoco without OpenGL, and forks the process that draws."""
    if gl.backend == "none":
        pytest.skip(f"no OpenGL here; install {gl.missing_packages}")
    late = views(gl.backend, tmp_path, "late")
    assert all(np.array_equal(picture, late[name]) for name, picture in views(gl.backend, tmp_path).items())


@pytest.mark.processes
def test_a_painting_process_needs_no_opengl(tmp_path: Path) -> None:
    assert len(views("none", tmp_path)) == 9


@pytest.mark.thorough
@pytest.mark.processes
def test_rendered_and_painted_pictures_show_the_same(gl: GlSupport, tmp_path: Path) -> None:
    if gl.backend == "none":
        pytest.skip(f"no OpenGL here; install {gl.missing_packages}")
    rendered, painted = views(gl.backend, tmp_path), views("none", tmp_path)
    for name, picture in rendered.items():
        distances = np.abs(picture.astype(int) - painted[name])
        assert distances.mean() < 4.0, name
        assert (distances > 40).mean() < 0.02, name
    for pictures in (rendered, painted):
        assert changed(pictures["pioneer_scout1"], pictures["empty_scout1"]) > 4000
        assert changed(pictures["pioneer_scout2"], pictures["empty_scout2"]) > 1000


def test_an_unchanged_scene_is_drawn_once() -> None:
    world = room()
    with Camera(world.mjcf, "paint") as camera:
        first = camera.picture("scout1")
        for _ in range(5):
            camera.show(world.state())
            assert camera.picture("scout1") is first
        assert camera.drawn == 1


def test_what_moves_outside_the_view_does_not_matter() -> None:
    pioneer = Target("pioneer", "pioneer", [(0.0, 3.0), (9.0, 3.0)], 0.5)
    states, drawn = states_of(pioneer, range(30, 330, 10)), {}
    for robot in ("scout1", "scout2"):
        with Camera(room(pioneer).mjcf, "paint") as camera:
            for state in states:
                camera.show(state)
                camera.picture(robot)
            drawn[robot] = camera.drawn
    assert 5 < drawn["scout1"] < 20
    assert drawn["scout2"] == 1


def states_of(target: Target, frames: range) -> list[NDArray[np.float64]]:
    world, states = room(target), []
    while world.frame < frames.stop:
        if world.frame in frames:
            states.append(world.state())
        world.step_frame()
    return states


def test_a_remembered_picture_is_the_one_that_would_be_drawn_in_whatever_order() -> None:
    pioneer = Target("pioneer", "pioneer", [(0.0, 3.0), (9.0, 3.0)], 0.5)
    states = states_of(pioneer, range(0, 150, 6))
    world = room(pioneer)
    with (
        Camera(world.mjcf, "paint") as there,
        Camera(world.mjcf, "paint") as back,
        Camera(world.mjcf, "paint", memo_pictures=0) as fresh,
    ):
        returning = {}
        for number, state in reversed([*enumerate(states)]):
            back.show(state)
            returning[number] = back.picture("scout1")
        for number, state in enumerate(states):
            there.show(state)
            fresh.show(state)
            picture = there.picture("scout1")
            assert np.array_equal(picture, fresh.picture("scout1"))
            assert np.array_equal(picture, returning[number])


def test_a_tremble_below_what_a_picture_shows_changes_nothing() -> None:
    world = room()
    with Camera(world.mjcf, "paint") as camera:
        camera.show(world.state())
        first = camera.picture("scout1")
        camera.show(world.state() + 1e-7)
        assert camera.picture("scout1") is first


def test_the_memo_keeps_the_last_pictures_and_no_more() -> None:
    pioneer = Target("pioneer", "pioneer", [(0.0, 3.0), (9.0, 3.0)], 0.5)
    states = states_of(pioneer, range(30, 60, 6))
    with Camera(room(pioneer).mjcf, "paint", memo_pictures=2) as camera:
        for state in (*states, states[-1], states[-2], states[0]):
            camera.show(state)
            camera.picture("scout1")
        assert camera.drawn == len(states) + 1


def test_a_picture_cannot_be_written_to() -> None:
    with Camera(room().mjcf, "paint") as camera, pytest.raises(ValueError, match="read-only"):
        camera.picture("scout1")[0, 0] = 1


def test_who_is_beside_the_picture_does_not_change_it() -> None:
    """Five Scouts in a row before the camera, and one more behind its back or just beyond the picture's edge."""
    seen = []
    for beside in ((0.72, 1.2), (0.1, 1.9), (3.0, 2.2)):
        row = [RobotPlace(f"scout{n}", n, 0.4 + 0.12 * n, 2.2 + 0.05 * n, 0.0) for n in range(2, 7)]
        places = [RobotPlace("scout1", 1, 0.72, 1.764, NORTH), *row, RobotPlace("scout9", 9, *beside, 0.7)]
        with Camera(World(WorldDescription(9.0, 6.0, 1, robots=places)).mjcf, "paint") as camera:
            seen.append(camera.picture("scout1"))
    assert np.array_equal(seen[0], seen[1])
    assert np.array_equal(seen[0], seen[2])
