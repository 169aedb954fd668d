"""What ``swap`` prints when an exchange is over."""

from __future__ import annotations

import pytest

from backbone.command_line.swapping import result_line
from backbone.exchange import SwapModule, Swapped


@pytest.mark.parametrize(
    ("prove_s", "proving_s", "rounds", "result"),
    [
        (5.0, 5.02, 20, "proved"),
        (5.0, 5.02, 0, "not proved yet"),  # a behavior that is suspended
        (0.0, 0.0, 0, "not proved yet"),  # it had no trial
        (5.0, 2.0, 0, "proved"),  # it succeeded without a command
    ],
)
def test_what_did_nothing_in_its_trial_is_not_called_proved(
    prove_s: float, proving_s: float, rounds: int, result: str
) -> None:
    asked = SwapModule("patrol", "my:Patrol", prove_s=prove_s)
    line = result_line(asked, Swapped(True, "", False, 0.05, proving_s, rounds), "command")
    assert line.startswith(f"patrol: {result}, my:Patrol goes on from a fresh state (0.05 s beside the old one, ")
