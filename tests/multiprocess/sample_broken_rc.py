"""An RC for tests of missions that do not come up."""

from __future__ import annotations

from resource_pool.rc_parameters import RcParameters
from resource_pool.resource_controller import ResourceController


class BrokenRc(ResourceController[RcParameters]):
    """Ends by a bug before it is ready."""

    async def connect(self) -> None:
        """Fail."""
        raise RuntimeError("the bug of the sample")
