"""Draw one picture with the OpenGL that MUJOCO_GL names and print which renderer did it.

Run as a program, in a process of its own, by ``gl_probe``: where OpenGL is missing, importing
mujoco raises or aborts the process.
"""

from __future__ import annotations

import sys

import mujoco
from OpenGL.GL import GL_RENDERER, glGetString  # type: ignore[import-untyped]

_BALL = "<mujoco><worldbody><light/><geom size='.1' rgba='1 1 1 1'/></worldbody></mujoco>"


def main() -> int:
    """Print the renderer's name; return 0 if something was drawn."""
    model = mujoco.MjModel.from_xml_string(_BALL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    renderer = mujoco.Renderer(model, 48, 64)
    try:
        renderer.update_scene(data)
        is_drawn = bool(renderer.render().any())
        sys.stdout.write(glGetString(GL_RENDERER).decode("utf-8", "replace") + "\n")
    finally:
        renderer.close()
    return 0 if is_drawn else 1


if __name__ == "__main__":
    sys.exit(main())
