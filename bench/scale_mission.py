"""The mission of ``scale.py``: many Scouts, a watcher for each; a radio, a frequency and a grabber for five."""

from __future__ import annotations

from math import ceil, sqrt

SHARING = 5  # Scouts that share a radio, a frequency and a grabber
APART_M = 1.5  # chosen: they stand still
NAME = "scale"
SETTLE_S = 0.3  # of a video frequency; a switch does not count it
CORE = 8  # the seven core services and the world


def mission_file(scouts: int, frame_rate_hz: float, slice_s: float) -> str:
    """Return the mission file."""
    teams = ceil(scouts / SHARING)
    columns = ceil(sqrt(scouts))
    side_m = (columns + 1) * APART_M
    numbers = range(1, scouts + 1)
    return "\n".join(
        [
            f'<mission name="{NAME}" priority="10">',
            '<hosts><host name="base" address="127.0.0.1" tags="radio video"/></hosts><resources>',
            *(_team(number, frame_rate_hz) for number in range(1, teams + 1)),
            *(_scout(number) for number in numbers),
            f'</resources><world name="world" host="base" seed="1"><room width-m="{side_m}" depth-m="{side_m}"/>',
            *(_place(number, *divmod(number - 1, columns)) for number in numbers),
            '</world><behaviors><behavior type="surveillance" name="surveillance" priority="5">',
            *(_watcher(number, slice_s) for number in numbers),
            "</behavior></behaviors></mission>",
        ]
    )


def components(scouts: int) -> int:
    """Return how many components there are once all watchers have their ARCs."""
    return CORE + 1 + 3 * ceil(scouts / SHARING) + 3 * scouts


def _team(number: int, frame_rate_hz: float) -> str:
    return (
        f'<resource type="command_radio" name="radio{number}" sharable="true" driver="simulated" process="hardware"/>'
        f'<resource type="video_frequency" name="video{number}" connect-s="{SETTLE_S}" driver="simulated"'
        ' process="hardware"/>'
        f'<resource type="framegrabber" name="grabber{number}" driver="simulated">'
        f'<uses type="video_frequency" name="video{number}"/>'
        f'<parameter name="frame_rate_hz" value="{frame_rate_hz}"/></resource>'
    )


def _scout(number: int) -> str:
    team = (number - 1) // SHARING + 1
    return (
        f'<resource type="scout" name="scout{number}" features="camera" driver="simulated" process="hardware">'
        f'<uses type="command_radio" name="radio{team}"/><uses type="video_frequency" name="video{team}"/>'
        f'<parameter name="network_id" value="{number}"/></resource>'
    )


def _place(number: int, row: int, column: int) -> str:
    x_m, y_m = (APART_M * (1 + at) for at in (column, row))
    return f'<robot name="scout{number}" x-m="{x_m}" y-m="{y_m}" heading-deg="90"/>'


def _watcher(number: int, slice_s: float) -> str:
    return (
        f'<behavior type="watch_for_motion" name="watch-scout{number}" priority="1">'
        f'<arc kind="capture" minimum-runtime-s="{slice_s}" period-s="0.1"><wish type="scout" name="scout{number}"/>'
        "</arc></behavior>"
    )
