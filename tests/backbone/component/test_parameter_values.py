"""Parameters that do not fit their class are refused with the names that there are."""

from __future__ import annotations

import msgspec
import pytest

from backbone.component.messages import WrongParameter
from backbone.component.parameter_values import parameters_from


class Way(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    waypoints: str
    speed_m_s: float = 0.1


@pytest.mark.parametrize("values", [{}, {"waypoint": "1,1"}, {"waypoints": 3}])
def test_a_refusal_names_the_parameters_of_the_class(values: dict[str, object]) -> None:
    """``start patrol`` was told to ask for the parameters of a component that did not run."""
    with pytest.raises(WrongParameter, match="patrol-1: ") as caught:
        parameters_from(values, Way, "patrol-1")
    assert caught.value.remedy == "Its parameters are waypoints, speed_m_s; give each a value of its type."
