"""The extra ``walker``: additional dependencies of the motion control."""

from __future__ import annotations

from backbone.errors import Refusal


class NoMink(Refusal):
    """The inverse kinematics cannot be imported on this host."""

    code = "walker.no_mink"
    remedy = "Install it on each host that may run a walker's RC: pip install 'scout-backbone[walker]'."
