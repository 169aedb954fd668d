"""Draw one picture with the OpenGL that MUJOCO_GL names; print the renderer and the libraries that it loaded.

``gl_probe`` runs this program in a process of its own, because without OpenGL the import of mujoco raises or aborts the
process.
"""

from __future__ import annotations

import sys
from pathlib import Path

import msgspec
import mujoco
from OpenGL.GL import GL_RENDERER, glGetString  # type: ignore[import-untyped]

from scout_model.gl_known import GlTrial

_BALL = "<mujoco><worldbody><light/><geom size='.1' rgba='1 1 1 1'/></worldbody></mujoco>"


def loaded_libraries() -> list[str]:
    """Return the paths of the shared libraries of this process."""
    parts = (line.split(maxsplit=5) for line in Path("/proc/self/maps").read_text().splitlines())
    return sorted({part[5] for part in parts if len(part) > 5 and ".so" in part[5]})


def main() -> int:
    """Print the renderer's name and the paths of its libraries as JSON; return 0 if a picture was drawn."""
    model = mujoco.MjModel.from_xml_string(_BALL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    renderer = mujoco.Renderer(model, 48, 64)
    try:
        renderer.update_scene(data)
        is_drawn = bool(renderer.render().any())
        name = glGetString(GL_RENDERER).decode("utf-8", "replace")
        sys.stdout.buffer.write(msgspec.json.encode(GlTrial(name, loaded_libraries())) + b"\n")
    finally:
        renderer.close()
    return 0 if is_drawn else 1


if __name__ == "__main__":
    sys.exit(main())
