"""Which addresses and keys a pattern means, as zenoh's key expressions do."""

import zenoh
from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.neighbor_declarations import matches

segments = st.lists(st.sampled_from(["a", "b", "frames"]), min_size=1, max_size=5)


@given(
    segments,
    st.lists(st.sampled_from(["a", "b", "frames", "*"]), min_size=1, max_size=4),
    st.integers(0, 4) | st.none(),
)
def test_a_pattern_means_what_zenoh_means_by_it(address: list[str], pattern: list[str], any_number: int | None) -> None:
    if any_number is not None:
        pattern = [*pattern[:any_number], "**", *pattern[any_number:], "frames"]
    expression = "/".join(pattern)
    means = zenoh.KeyExpr.autocanonize(expression).intersects(zenoh.KeyExpr("/".join(address)))
    assert matches(expression, "/".join(address)) is means
