"""Sessions of zenoh that cannot be closed."""

from __future__ import annotations

from typing import Any, cast

import pytest
import zenoh

from backbone.bus.zenoh_sessions import close_session


class HangingSession:
    """Its threads hang, so zenoh stops waiting for them."""

    def close(self) -> None:
        raise zenoh.ZError("close operation timed out!")


async def test_a_component_that_ends_does_not_fail_because_its_session_hangs(caplog: pytest.LogCaptureFixture) -> None:
    hanging: Any = HangingSession()
    await close_session(cast("zenoh.Session", hanging))
    assert "a session is left as it is: close operation timed out!" in caplog.text
