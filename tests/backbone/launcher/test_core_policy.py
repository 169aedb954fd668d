"""How the launcher restarts core services."""

from __future__ import annotations

from backbone.launcher.core_launches import CORE_POLICY
from backbone.rc_manager.messages import RENEW_EVERY_S
from backbone.scheduling.requests import LEASE_S

START_S = 0.6  # from a SIGKILL until a new RC manager is ready, on a busy machine, pause not counted


def test_leases_outlast_a_restart_of_the_rc_manager_however_often_it_fell_before() -> None:
    assert CORE_POLICY.back_off_most_s + START_S < LEASE_S - RENEW_EVERY_S
