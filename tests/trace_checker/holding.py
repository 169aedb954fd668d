"""What may hold an RC: EXCL, CAP, RTA, DOWN; and the times of a switch: GRACE, SETTLE, EPOCH."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .state import Arc, Phase, Rc
from .violation import Violation

if TYPE_CHECKING:
    from .replay import Replay


def connects(replay: Replay, arc: Arc) -> None:
    """Report each RC on which the ARC cannot be beside those that hold it."""
    for name in arc.uses:
        rc = replay.world.rcs[name]
        if not rc.up:
            replay.report("DOWN", arc.name, f"connects to {name}, which is down")
        code = replay.world.why_not(name, frozenset([arc, *rc.holders.values()]))
        if code:
            replay.report(code, arc.name, f"on {name} beside {', '.join(rc.holders) or 'no other ARC'}")


def granted(replay: Replay, arc: Arc, epochs: dict[str, int]) -> None:
    settled_s = replay.now_s - arc.connect_s
    if settled_s < arc.settle_s - replay.slack_s:
        replay.report("SETTLE", arc.name, f"granted {settled_s:.3f} s after its connect, settling takes {arc.settle_s}")
    for name, epoch in epochs.items():
        rc = replay.world.rcs[name]
        if epoch <= rc.epoch:
            replay.report("EPOCH", arc.name, f"{name}: {epoch} after {rc.epoch}")
        rc.epoch = max(rc.epoch, epoch)


def time_passes(replay: Replay, until_s: float) -> None:
    """Report what should have ended before this time."""
    for rc in replay.world.rcs.values():
        _loses_its_holders(replay, rc, until_s)
    for arc in replay.world.arcs.values():
        if arc.phase is Phase.REVOKING:
            latest_s = arc.revoke_s + replay.grace_s + arc.release_s + replay.slack_s
            if replay.now_s <= latest_s < until_s:
                arc.late = Violation(
                    "GRACE", replay.now_s, arc.name, f"revoked at {arc.revoke_s:.3f}, not free by {latest_s:.3f}"
                )


def is_free(replay: Replay, arc: Arc) -> None:
    """Report that it took too long, unless an RC was down meanwhile: one that is dead cannot confirm in time."""
    if arc.late and not arc.has_lost:
        replay.found.append(arc.late)
    arc.late, arc.has_lost = None, False


def _loses_its_holders(replay: Replay, rc: Rc, until_s: float) -> None:
    """Report holders of an RC that went down, or that has too little capacity for them, when the tolerance is over."""
    if rc.down_s is not None and rc.down_s + replay.slack_s < until_s:
        for arc in replay.world.keepers(rc.name):
            replay.report("DOWN", arc.name, f"holds {rc.name}, which is down since {rc.down_s:.3f}")
        rc.down_s = None
    if rc.changed_s is not None and rc.changed_s + replay.slack_s < until_s:
        code = replay.world.why_not(rc.name, frozenset(replay.world.keepers(rc.name)))
        if code:
            replay.report(code, rc.name, f"exceeds its capacity since {rc.changed_s:.3f}")
        rc.changed_s = None
