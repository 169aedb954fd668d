"""Which OpenGL draws here: what a trial finds, who tries, and how long a success is believed."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from full_disk import disk_full_at

from scout_model import gl_known, gl_probe
from scout_model.gl_known import GlTrial
from scout_model.gl_probe import FOUND_FILE, GlSupport, forget, probe, probe_once


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give an account that knows no renderer, and return where it keeps one."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "scout-backbone" / gl_known.FILE


@pytest.fixture
def library(tmp_path: Path) -> Path:
    path = tmp_path / "libEGL.so.1"
    path.write_bytes(b"machine code")
    return path


@pytest.mark.processes
def test_a_probe_says_who_renders_or_which_packages_are_missing() -> None:
    gl = probe()
    assert bool(gl.renderer) == (gl.backend != "none") == (not gl.missing_packages)
    assert gl.camera_backend == ("paint" if gl.backend == "none" else "gl")
    assert (gl.renderer or "libegl1") in gl.summary


def test_a_machine_without_egl_drivers_is_recognized(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere.json")
    assert probe().backend != "egl"


def test_a_driver_that_hangs_does_not_hang_the_probe() -> None:
    support = probe(trial_time_s=0.001)
    assert (support.backend, support.camera_backend) == ("none", "paint")
    assert support.missing_packages == "libegl1 libopengl0 libgl1-mesa-dri"


def test_of_many_who_ask_with_one_folder_only_one_probes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found, probed, together = GlSupport("egl", "a renderer", ""), [], threading.Barrier(4)

    def probe_slowly(_trial_time_s: float) -> GlSupport:
        probed.append(threading.get_ident())
        with contextlib.suppress(threading.BrokenBarrierError):
            together.wait(0.1)  # would end at once if the others probed as well
        return found

    monkeypatch.setattr(gl_probe, "probe", probe_slowly)
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(lambda _number: probe_once(tmp_path), range(4))) == [found] * 4
    assert len(probed) == 1


def test_what_somebody_died_over_while_writing_it_is_found_out_anew(tmp_path: Path) -> None:
    (tmp_path / FOUND_FILE).write_bytes(b'{"backend":"eg')
    first = probe_once(tmp_path, trial_time_s=0.001)
    assert first.backend == "none"
    assert probe_once(tmp_path) == first, "it was not kept"


@pytest.mark.parametrize("folder", ["gone", "file"])
def test_a_folder_that_cannot_be_written_into_makes_probing_only_slower(tmp_path: Path, folder: str) -> None:
    (tmp_path / "file").touch()
    assert probe_once(tmp_path / folder, trial_time_s=0.001).backend == "none"


def test_a_disk_that_is_full_makes_probing_only_slower(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found, probed = GlSupport("egl", "a renderer", ""), []
    monkeypatch.setattr(gl_probe, "probe", lambda trial_time_s: probed.append(trial_time_s) or found)
    with disk_full_at(0):
        assert [probe_once(tmp_path) for _ in range(2)] == [found] * 2
    assert len(probed) == 2
    assert [probe_once(tmp_path) for _ in range(2)] == [found] * 2
    assert len(probed) == 3, "kept as soon as there is room"


@pytest.mark.processes
def test_probing_imports_no_mujoco() -> None:
    program = "import sys; from scout_model.gl_probe import probe; probe(0.001); assert 'mujoco' not in sys.modules"
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


@pytest.mark.processes
def test_what_drew_is_not_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    first = probe()
    if first.backend == "none":
        pytest.skip(f"no OpenGL here; install {first.missing_packages}")
    monkeypatch.setattr(subprocess, "run", None)
    assert probe() == first


@pytest.mark.processes
def test_a_failure_is_tried_again(cache: Path) -> None:
    assert probe(trial_time_s=0.001).backend == "none"
    assert not cache.exists()


def known(library: Path) -> str | None:
    found = gl_known.recall()
    assert found is None or str(library) in found.files
    return None if found is None else found.renderer


def test_nothing_is_known_before_the_first_trial(library: Path) -> None:
    assert known(library) is None


@pytest.mark.parametrize("change", ["upgraded", "removed", "touched"])
def test_a_library_that_changes_ends_the_belief(library: Path, change: str) -> None:
    gl_known.keep("egl", GlTrial("a renderer", [str(library)]))
    assert known(library) == "a renderer"
    match change:
        case "upgraded":
            library.write_bytes(b"other machine code")
        case "removed":
            library.unlink()
        case "touched":
            os.utime(library, ns=(1, 1))
    assert known(library) is None


def test_a_device_that_comes_or_is_forbidden_ends_the_belief(
    library: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gl_known, "DEVICES", (f"{tmp_path}/renderD*",))
    gl_known.keep("egl", GlTrial("a renderer", [str(library)]))
    (tmp_path / "renderD128").touch()
    assert known(library) is None
    gl_known.keep("egl", GlTrial("a renderer", [str(library)]))
    assert known(library) == "a renderer"
    monkeypatch.setattr(os, "access", lambda _path, _mode: False)
    assert known(library) is None


@pytest.mark.parametrize("name", ["GALLIUM_DRIVER", "__EGL_VENDOR_LIBRARY_FILENAMES", "MUJOCO_EGL_DEVICE_ID"])
def test_another_choice_of_driver_ends_the_belief(library: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    gl_known.keep("osmesa", GlTrial("a renderer", [str(library)]))
    monkeypatch.setenv(name, "other")
    assert known(library) is None
    monkeypatch.delenv(name)
    assert known(library) == "a renderer"


def test_another_installation_of_python_tries_for_itself(library: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gl_known.keep("egl", GlTrial("a renderer", [str(library)]))
    monkeypatch.setattr(sys, "prefix", "/another/environment")
    assert known(library) is None


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"backend":"none","renderer":"x"}', bytes(1000)])
def test_a_file_that_is_not_what_was_kept_is_nothing(cache: Path, library: Path, content: bytes) -> None:
    cache.parent.mkdir(parents=True)
    cache.write_bytes(content)
    assert known(library) is None
    gl_known.keep("egl", GlTrial("a renderer", [str(library)]))
    assert known(library) == "a renderer"


def test_an_account_that_cannot_keep_anything_tries_each_time(library: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for place in (str(library), "/proc/nowhere"):  # a file instead of a folder, a file system without files
        monkeypatch.setenv("XDG_CACHE_HOME", place)
        gl_known.keep("egl", GlTrial("a renderer", [str(library)]))
        assert known(library) is None
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr(Path, "home", homeless)
    gl_known.keep("egl", GlTrial("a renderer", [str(library)]))
    assert known(library) is None


def homeless() -> Path:
    raise RuntimeError("Could not determine home directory.")


def test_a_belief_that_was_wrong_is_forgotten(cache: Path, library: Path, tmp_path: Path) -> None:
    gl_known.keep("egl", GlTrial("a renderer", [str(library)]))
    assert probe_once(tmp_path) == GlSupport("egl", "a renderer", "")
    forget(tmp_path)
    assert not cache.exists()
    assert probe_once(tmp_path, trial_time_s=0.001).backend == "none"


def test_lines_of_a_driver_beside_the_answer_do_no_harm(monkeypatch: pytest.MonkeyPatch, library: Path) -> None:
    answer = b'MESA: warning\n{"renderer":"a renderer","libraries":["%s"]}\nbye\n' % str(library).encode()
    done = subprocess.CompletedProcess[bytes]([], 0, answer, b"")
    monkeypatch.setattr(subprocess, "run", lambda *_words, **_options: done)
    assert probe().renderer == "a renderer"
    assert known(library) == "a renderer"
