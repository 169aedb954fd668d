"""The names of the rules that a trace can break, and one finding."""

from __future__ import annotations

from dataclasses import dataclass

NAMES = {
    "FORM": "a line that the format does not have, or a step that cannot follow the step before it",
    "EXCL": "an exclusive use beside another holder",
    "CAP": "the streams on a sharable RC need more than its capacity",
    "RTA": "a stream on a sharable RC can miss its deadline",
    "DOWN": "an RC that is down gets or keeps a holder",
    "MINRUN": "an ARC loses its RCs before its minimum run time, and no higher ARC needs them",
    "PRIO": "a lower ARC holds or gets what a higher ARC could have now",
    "RR": "a served ARC keeps its RCs although an equal ARC could start",
    "WC": "an ARC waits for RCs that are free, although its run would delay no ARC before it",
    "DELAY": "a start moves the planned start of an equal ARC that is before it",
    "FUTILE": "an ARC starts although a higher ARC is due before its minimum run time is over",
    "SPURIOUS": "a slice ends although no waiting ARC can use its RCs",
    "DEMOTE": "an ARC loses its RCs to a lower ARC",
    "GRACE": "a revoked ARC keeps its RCs longer than the grace and the disconnect time",
    "SETTLE": "a grant before the RCs have settled",
    "EPOCH": "an epoch that does not grow",
    "FAIR": "a wait among equal ARCs that is longer than the bound",
    "TURNS": "numbers of turns that differ by more than one among equal rivals",
    "SHARE": "times that differ by more than the discipline of equal time allows",
    "STRICT": "under the strict policy, a start while a higher usable ARC of the group waits",
}


@dataclass(frozen=True, slots=True)
class Violation:
    """One finding.

    Attributes:
        code: A key of ``NAMES``.
        t: When, in seconds of the mission's clock.
        arc: Which ARC, or which RC where the finding is about no ARC.
        msg: The numbers.
    """

    code: str
    t: float
    arc: str
    msg: str

    def __str__(self) -> str:
        return f"{self.code:8} t={self.t:<10g} {self.arc}: {self.msg}"
