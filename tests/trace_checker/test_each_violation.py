"""One short trace for each name of a violation, and the same trace without the fault."""

from __future__ import annotations

from typing import Any

import pytest

from trace_checker import NAMES, check
from trace_checker.trace_format import Line

HOLDS = {"v": "x"}


def meta(**changed: Any) -> Line:
    sound = {"v": 1, "mode": "no_delay", "discipline": "turns", "wc": "plan", "grace": 0.2, "tol": 1e-6}
    return {"ev": "meta", "t": 0.0, **sound, **changed}


def rc(name: str, kind: str = "unit", connect: float = 0.0, disconnect: float = 0.0) -> Line:
    return {"ev": "rc", "t": 0.0, "id": name, "kind": kind, "cap": 1.0, "connect": connect, "disconnect": disconnect}


def ask(t: float, arc: str, prio: int = 1, use: dict[str, Any] | None = None, run: float = 5.0) -> Line:
    owner = {"ui": prio, "id": f"owner of {arc}"}
    return {"ev": "request", "t": t, "arc": arc, "owner": owner, "min_run": run, "max_run": run, "use": use or HOLDS}


def load(share: float, **more: float) -> dict[str, Any]:
    return {"r": [{"period": 0.1, "cost": 0.1 * share, **more}]}


def starts(t: float, arc: str, *, settled: float | None = None, **epochs: int) -> list[Line]:
    granted_s = t if settled is None else settled
    return [
        {"ev": "connect", "t": t, "arc": arc},
        {"ev": "grant", "t": granted_s, "arc": arc, "epoch": epochs},
    ]


def ends(t: float, arc: str, why: str = "slice", *, free: float | None = None) -> list[Line]:
    free_s = t if free is None else free
    return [{"ev": "revoke", "t": t, "arc": arc, "why": why}, {"ev": "free", "t": free_s, "arc": arc}]


def line(event: str, t: float, **fields: Any) -> Line:
    return {"ev": event, "t": t, **fields}


def codes(*lines: Line, end: float, rules: Line | None = None) -> set[str]:
    return {one.code for one in check([rules or meta(), *lines, line("end", end)])}


V = rc("v")
R = rc("r", "share")
A, B = ask(0.0, "a"), ask(0.0, "b")
HIGH = ask(0.0, "high", 2)
BROKEN: dict[str, tuple[tuple[Line, ...], tuple[Line, ...]]] = {
    "FORM": (
        (V, A, *starts(0, "a"), line("grant", 1, arc="a", epoch={})),
        (V, A, *starts(0, "a")),
    ),
    "EXCL": (
        (V, A, *starts(0, "a"), B, *starts(5, "b")),
        (V, A, *starts(0, "a"), B, *ends(5, "a"), *starts(5, "b")),
    ),
    "CAP": (
        (R, ask(0, "a", use=load(0.6)), *starts(0, "a"), ask(0, "b", use=load(0.6)), *starts(5, "b")),
        (R, ask(0, "a", use=load(0.6)), *starts(0, "a"), ask(0, "b", use=load(0.4)), *starts(0, "b")),
    ),
    "RTA": (
        (R, ask(0, "a", use=load(0.3)), *starts(0, "a"), ask(0, "b", use=load(0.3, deadline=0.05)), *starts(0, "b")),
        (R, ask(0, "a", use=load(0.3)), *starts(0, "a"), ask(0, "b", use=load(0.3, deadline=0.06)), *starts(0, "b")),
    ),
    "DOWN": (
        (V, A, *starts(0, "a"), line("rc_state", 1, id="v", state="down"), *ends(1.1, "a", "rc")),
        (V, A, *starts(0, "a"), line("rc_state", 1, id="v", state="down"), *ends(1, "a", "rc")),
    ),
    "MINRUN": (
        (V, A, *starts(0, "a"), B, *ends(4, "a"), *starts(4, "b")),
        (V, A, *starts(0, "a"), B, *ends(5, "a"), *starts(5, "b")),
    ),
    "PRIO": (
        (V, A, *starts(0, "a"), {**HIGH, "t": 1.0}, *ends(2, "a", "higher"), *starts(2, "high")),
        (V, A, *starts(0, "a"), {**HIGH, "t": 1.0}, *ends(1, "a", "higher"), *starts(1, "high")),
    ),
    "RR": (
        (V, A, *starts(0, "a"), B, *ends(6, "a"), *starts(6, "b")),
        (V, A, *starts(0, "a"), B, *ends(5, "a"), *starts(5, "b")),
    ),
    "WC": (
        (V, A, *starts(1, "a")),
        (V, A, *starts(0, "a")),
    ),
    "DELAY": (  # of three equals the youngest goes before the older one
        (V, A, *starts(0, "a"), ask(1, "b"), ask(2, "c"), *ends(5, "a"), *starts(5, "c")),
        (V, A, *starts(0, "a"), ask(1, "b"), ask(2, "c"), *ends(5, "a"), *starts(5, "b")),
    ),
    "FUTILE": (  # the lower one needs 8 s in a gap of 5 s
        (
            *(V, rc("w"), ask(0, "a", 2), *starts(0, "a"), ask(0, "b", 2, {"v": "x", "w": "x"})),
            *(ask(0, "low", 1, {"w": "x"}, run=8), *starts(0, "low")),
        ),
        (
            *(V, rc("w"), ask(0, "a", 2), *starts(0, "a"), ask(0, "b", 2, {"v": "x", "w": "x"})),
            *(ask(0, "low", 1, {"w": "x"}, run=5), *starts(0, "low")),
        ),
    ),
    "SPURIOUS": (
        (V, A, *starts(0, "a"), *ends(5, "a"), *starts(5, "a")),
        (V, A, *starts(0, "a")),
    ),
    "DEMOTE": (
        (V, HIGH, *starts(0, "high"), A, *ends(5, "high"), *starts(5, "a")),
        (V, HIGH, *starts(0, "high"), A),
    ),
    "GRACE": (
        (V, A, *starts(0, "a"), B, *ends(5, "a", free=5.3), *starts(5.3, "b")),
        (V, A, *starts(0, "a"), B, *ends(5, "a", free=5.1), *starts(5.1, "b")),
    ),
    "SETTLE": (
        (rc("v", connect=0.3), A, *starts(0, "a", settled=0.2)),
        (rc("v", connect=0.3), A, *starts(0, "a", settled=0.3)),
    ),
    "EPOCH": (
        (V, A, *starts(0, "a", v=7), B, *ends(5, "a"), *starts(5, "b", v=7)),
        (V, A, *starts(0, "a", v=7), B, *ends(5, "a"), *starts(5, "b", v=8)),
    ),
    "FAIR": (
        (V, A, *starts(0, "a"), B, line("extend", 1, arc="a", until=5.0)),
        (V, A, *starts(0, "a"), B, *ends(5, "a"), *starts(5, "b")),
    ),
    "TURNS": (
        (V, A, B, *starts(0, "a"), *ends(5, "a"), *starts(5, "a")),
        (V, A, B, *starts(0, "a"), *ends(5, "a"), *starts(5, "b")),
    ),
}
BROKEN["new slices"] = (  # beside no equal that comes or goes
    (R, ask(0, "a", use=load(0.4)), *starts(0, "a"), line("slice", 5, arc="a")),
    (
        *(R, ask(0, "a", use=load(0.4)), *starts(0, "a"), ask(0, "b", use=load(0.4)), *starts(0, "b")),
        *(ask(0, "c", use=load(0.4)), ends(5, "a")[0], line("slice", 5, arc="b"), ends(5, "a")[1], *starts(5, "c")),
    ),
)
END_S = {"FAIR": 10.0, "DELAY": 5.0, "FUTILE": 1.0, "DEMOTE": 5.5}


@pytest.mark.parametrize("code", BROKEN)
def test_the_fault_is_found(code: str) -> None:
    broken, _ = BROKEN[code]
    end_s = END_S.get(code, max(one["t"] for one in broken))
    assert ("SPURIOUS" if code == "new slices" else code) in codes(*broken, end=end_s)


@pytest.mark.parametrize("code", BROKEN)
def test_without_the_fault_nothing_is_found(code: str) -> None:
    _, sound = BROKEN[code]
    end_s = max(min(END_S.get(code, 5.0), 5.0), *(one["t"] for one in sound))
    assert codes(*sound, end=end_s) == set()


def test_strict_forbids_what_fills_a_gap() -> None:
    """S10: as S2, and under the strict policy the lower one never starts while a higher one waits."""
    lines = (
        *(V, rc("w"), ask(0, "a", 2), *starts(0, "a"), ask(0, "b", 2, {"v": "x", "w": "x"})),
        *(ask(0, "low", 1, {"w": "x"}), *starts(0, "low")),
    )
    assert codes(*lines, end=1.0) == set()
    assert codes(*lines, end=1.0, rules=meta(mode="strict")) == {"STRICT"}
    assert codes(*lines[:-2], end=1.0, rules=meta(mode="strict")) == set()


def alternate(first_turns: int) -> list[Line]:
    """Return turns of 5 s: so many of the first one for each of the second."""
    found, time_s = [V, A, B], 0.0
    for turn in range(12):
        arc = "b" if turn % (first_turns + 1) == first_turns else "a"
        found += [*starts(time_s, arc), *ends(time_s + 5.0, arc)]
        time_s += 5.0
    return found


def test_share_compares_the_times_of_rivals() -> None:
    rules = meta(discipline="time")
    assert "SHARE" not in codes(*alternate(1), end=60.0, rules=rules)
    assert "SHARE" in codes(*alternate(5), end=60.0, rules=rules)


def test_each_name_has_its_test() -> None:
    assert {*BROKEN, "STRICT", "SHARE"} == {*NAMES, "new slices"}


def test_a_new_slice_cannot_begin_before_the_old_one_is_over() -> None:
    lines = [R, ask(0, "a", use=load(0.4)), *starts(0, "a"), line("slice", 4, arc="a")]
    assert codes(*lines, end=4.5) == {"FORM", "SPURIOUS"}


def test_a_changed_number_counts_for_those_that_asked_before() -> None:
    console = line("node", 2, id="console owner of b", parent=None, prio=3)
    lines = [V, A, *starts(0, "a"), B, console]
    assert codes(*lines, *ends(2, "a", "higher"), *starts(2, "b"), end=5.0) == set()
    assert codes(*lines, end=5.0) == {"PRIO"}


def test_what_was_freed_by_force_goes_to_the_one_it_was_freed_for() -> None:
    """Hazard b: an equal of the cut one is older than the higher one that cut it."""
    low = [ask(0, "h", 1), ask(0, "e", 2, {"v": "x", "w": "x"}), ask(1, "x", 3, {"v": "x"})]
    lines = [V, rc("w"), low[0], *starts(0, "h")]
    cut = [low[2], *ends(1, "h", "higher")]
    assert codes(*lines, *cut, *starts(1, "x"), end=2.0) == set()
    assert "WC" in codes(*lines, *cut, end=2.0)
