"""``scout-backbone`` ``bridge``, ``metrics``: show a mission that is up in other tools. They change nothing in it.

Rules of this file: as those of ``cli``.
"""

from __future__ import annotations

from typing import Annotated

import typer

from backbone.command_line.at_mission import AtMission
from backbone.command_line.extras import needing_extras
from backbone.command_line.options import MOST_PORT, run
from backbone.command_line.recording_commands import Keys
from backbone.command_line.where import Where

BRIDGE_PORT = 8765  # where Foxglove looks first
METRICS_PORT = 9464  # OpenTelemetry's port for Prometheus

Host = Annotated[
    str, typer.Option("--host", help="Address to listen at; every client there can read all. Default: this machine.")
]


@AtMission
def bridge(
    where: Where,
    keys: Keys = None,
    host: Host = "127.0.0.1",
    port: Annotated[int, typer.Option("--port", min=1, max=MOST_PORT, help="Port to listen at.")] = BRIDGE_PORT,
) -> None:
    """Show a mission live in Foxglove or Lichtblick: cameras, robots in their room, all messages; until Ctrl-C."""
    with needing_extras():
        from backbone.command_line.bridging import bridge as show_live
    run(lambda: show_live(where, host, port, tuple(keys or ())))


@AtMission
def metrics(
    where: Where,
    host: Host = "127.0.0.1",
    port: Annotated[int, typer.Option("--port", min=1, max=MOST_PORT, help="Port to listen at.")] = METRICS_PORT,
) -> None:
    """Serve metrics to Prometheus: holding and waiting times of resources, switches, drops; until Ctrl-C."""
    with needing_extras():
        from backbone.command_line.metrics_work import serve_metrics
    run(lambda: serve_metrics(where, host, port))
