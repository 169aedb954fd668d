"""``creator``: offers this machine to a mission elsewhere."""

from __future__ import annotations

from pathlib import Path

from backbone.command_line.where import read_secret_option
from backbone.launcher.endings import ExitCode, say
from backbone.launcher.kept_creator import Offered
from backbone.launcher.mission_recorder import require_writable
from backbone.launcher.offer import Offering
from backbone.launcher.preconditions import refuse_paths_of_no_message, require_process_table


async def offer_this_machine(
    mission: str, connect: str, secret_file: Path | None, host: str, tags: tuple[str, ...], record: Path | None
) -> ExitCode:
    """Run a creator on this machine for the mission until it or a signal ends the offer."""
    offered = Offered(mission, connect, host, tags, read_secret_option(secret_file), record)
    is_file = secret_file is not None and str(secret_file) != "-"
    require_process_table()
    if record is not None:
        refuse_paths_of_no_message(mission, record)
        require_writable(record)
    say(f"{host} is offered to mission {mission}; end with Ctrl-C")
    await Offering(offered, say, secret_file if is_file else None).run()
    return ExitCode.DONE
