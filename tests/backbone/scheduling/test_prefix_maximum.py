"""Values of higher paths, against looking at each of them."""

from __future__ import annotations

import math

from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st

from backbone.scheduling.prefix_maximum import PrefixMaximum
from backbone.scheduling.priority import Path, higher

NUMBERS = dict(zip("abcdef", (0, 0, 1, 1, 2, 0), strict=True))
paths = st.lists(st.sampled_from("abcdef"), min_size=1, max_size=4).map(
    lambda names: tuple((name, NUMBERS[name] + depth % 2) for depth, name in enumerate(names))
)


@settings(max_examples=share(100))
@given(st.lists(st.tuples(paths, st.floats(0, 100)), max_size=12), paths)
def test_the_largest_value_above_a_path_is_that_of_those_higher_than_it(known: list[tuple[Path, float]], path: Path):
    above = PrefixMaximum()
    for one, value in known:
        above.add(one, value)
    assert above.largest(path) == max((value for one, value in known if higher(one, path)), default=-math.inf)
