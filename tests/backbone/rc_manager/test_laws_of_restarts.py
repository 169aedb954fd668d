"""Laws of an RC manager that is killed at any moment, also amid a context switch: on the local bus."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from rc_manager_at_work import Pool, request
from trace_checker import check, read_lines

from backbone.bus.clock import run_virtual
from backbone.errors import LinkError, Refusal

SLICE_S, SETTLE_S = 2.0, 0.3
EDGES_S = [turn * (SLICE_S + SETTLE_S) + late_s for turn in range(8) for late_s in (0.0, 1e-9, 0.001, SETTLE_S)]
moments = st.lists(
    st.tuples(st.one_of(st.sampled_from(EDGES_S), st.floats(0.0, 18.0)), st.sampled_from([0.0, 0.05, 0.5])),
    max_size=8,
)


@example(deaths=[(SLICE_S + SETTLE_S, 0.05), (6.9, 0.0)], names=["a", "b", "c"])  # a slice was over meanwhile
@given(deaths=moments, names=st.permutations(["a", "b", "c"]))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_equals_take_turns_however_often_the_rc_manager_dies(
    pool: Any, deaths: list[tuple[float, float]], names: list[str]
) -> None:
    """Rule 12; and the trace of each RC manager keeps all rules."""

    async def main() -> tuple[Path, dict[str, int]]:
        async with pool() as here:
            here.trace.unlink(missing_ok=True)
            arcs = {name: await here.arc(name) for name in "abc"}
            asking = asyncio.create_task(_ask(here, [arcs[name] for name in names]))
            for at_s, away_s in sorted(deaths):
                await _live_until(here, max(at_s, here.clock.now_s()))
                await here.clock.sleep_s(away_s)
            await _live_until(here, here.clock.now_s() + 12.0)
            await asking
            return here.trace, {name: sum(what == "open" for what, *_ in arc.log) for name, arc in arcs.items()}

    trace, turns = run_virtual(main())
    assert max(turns.values()) - min(turns.values()) <= 1, turns
    assert check(read_lines(trace)) == []


async def _ask(here: Pool, arcs: Sequence[Any]) -> None:
    for arc in arcs:
        while True:
            try:
                await arc.ask_for(request(arc.name, "video", minimum_runtime_s=SLICE_S))
                break
            except (Refusal, LinkError):
                await here.clock.sleep_s(0.01)


async def _live_until(here: Pool, end_s: float) -> None:
    """Let an RC manager live until then, and kill it as SIGKILL does."""
    manager = here.manager()
    life = asyncio.create_task(manager.run(), name="life of rc_manager")
    await here.clock.sleep_until_s(end_s)
    life.cancel()
    await asyncio.wait({life})
