"""BehaviorMemory: keeps the progress of a behavior for its next process.

A process that is killed loses what it knew. The behavior's next process on this host continues from a file of the
mission's folder, if both carry out the same order of the owner: a child that its parent starts again begins anew.

If the behavior ends again and again without any progress, its memory may be the cause, so it begins anew.
"""

from __future__ import annotations

import logging

import msgspec

from backbone.atomic_file import replace_file
from backbone.component.launch import Launch
from backbone.kept_file import KeptFile
from backbone.mission.behavior_orders import TREE_PARAMETERS
from mission_control.behavior_hooks import BehaviorHooks
from mission_control.behavior_of_parts import BehaviorOfParts
from mission_control.children import ChildrenMemory
from mission_control.children_loop import ChildrenLoop
from mission_control.messages import BehaviorStatus

log = logging.getLogger(__name__)

MOST_RECALLS = 5  # chosen: a quarter of the restarts after which a parent gives up its child
CALM_S = 10.0  # chosen: after a longer life, the end of a process has another cause than the memory; mission seconds


class KeptBehavior(msgspec.Struct, frozen=True, kw_only=True):
    """What a behavior keeps.

    Attributes:
        order_id: See ``Launch``.
        parameters: Its own parameters, without those of the tree.
        status: Its status; final: it only has to report it.
        payload: The last report, if it is final.
        children: State of the rules for its children.
        own: Its ``memory_type``, encoded; empty: none.
        recalls: Number of processes that continued from this and did not live for long.
        recalled_s: Mission time of the last of them.
    """

    order_id: str
    parameters: dict[str, object]
    status: BehaviorStatus
    payload: dict[str, object]
    children: ChildrenMemory
    own: bytes
    recalls: int = 0
    recalled_s: float = 0.0


class BehaviorMemory:
    """The memory of one behavior.

    Args:
        behavior: The behavior.
        hooks: Its hooks; the same behavior.
        children: Its children.
    """

    def __init__(self, behavior: BehaviorOfParts, hooks: BehaviorHooks, children: ChildrenLoop, launch: Launch) -> None:
        self._behavior, self._hooks, self._children, self._order_id = behavior, hooks, children, launch.order_id
        self._file = KeptFile(launch.run_directory if launch.order_id else "", "behaviors", launch.name)
        self._content = b""

    def keep(self) -> None:
        """Replace the kept state by the present one, if it differs and the implementation is in charge."""
        if not self._behavior.gate.is_open or self._file.path is None:
            return
        of, own = self._behavior, self._hooks.memory()
        try:
            now = KeptBehavior(
                order_id=self._order_id,
                parameters=self._parameters(),
                status=of.status,
                payload=dict(of.payload) if of.status.is_final else {},
                children=self._children.memory(),
                own=b"" if own is None else msgspec.msgpack.encode(own),
            )
            content = msgspec.msgpack.encode(now)
        except (TypeError, ValueError, OverflowError) as error:  # such as a number of numpy in a report
            self._give_up(error)
            return
        if content != self._content:
            self._content = content
            self._write(content)

    def recall(self) -> BehaviorStatus:
        """Continue from what the last process kept under this order, if anything; return the behavior's status.

        A class that warms up beside another one continues from that one's state, not from what is kept.
        """
        if self._behavior.gate.is_first and (kept := self._read()) is not None:
            self._continue_from(kept)
        return self._behavior.status

    def _continue_from(self, kept: KeptBehavior) -> None:
        behavior, now_s = self._behavior, self._behavior.clock.now_s()
        recalls = kept.recalls + 1 if now_s - kept.recalled_s < CALM_S else 1
        if recalls > MOST_RECALLS:
            behavior.publish_event(behavior.name, "begins anew: it ended again and again without progress")
            self._children.begun_anew = kept.children.begun_anew + 1
            return
        self._content = msgspec.msgpack.encode(msgspec.structs.replace(kept, recalls=0, recalled_s=0.0))
        self._write(msgspec.msgpack.encode(msgspec.structs.replace(kept, recalls=recalls, recalled_s=now_s)))
        behavior.story.note(behavior.name, "continues from the progress of its last process")
        if kept.status.is_final:
            behavior.status, behavior.payload = kept.status, kept.payload
            behavior.report(f"finished: {kept.status}")
            return
        self._children.resume(kept.children)
        if (own := self._own(kept)) is not None:
            self._hooks.recall(own)

    def _own(self, kept: KeptBehavior) -> msgspec.Struct | None:
        """Return the memory of the class; None: there is none, or for other parameters, or of another class."""
        kind = self._hooks.memory_type
        if kind is None or not kept.own or kept.parameters != self._parameters():
            return None
        try:
            return msgspec.msgpack.decode(kept.own, type=kind)
        except msgspec.DecodeError as error:
            log.warning("%s begins anew: another class kept its memory: %s", self._behavior.name, error)
            return None

    def _parameters(self) -> dict[str, object]:
        given = msgspec.to_builtins(self._behavior.parameters)
        return {name: value for name, value in given.items() if name not in TREE_PARAMETERS}

    def _read(self) -> KeptBehavior | None:
        try:
            found = self._file.read()
            kept = None if found is None else msgspec.msgpack.decode(found, type=KeptBehavior)
        except (OSError, msgspec.DecodeError) as error:
            log.warning("%s begins anew: %s: %s", self._behavior.name, self._file.path, error)
            return None
        return kept if kept is not None and kept.order_id == self._order_id else None

    def _write(self, content: bytes) -> None:
        try:
            if (target := self._file.target()) is not None:
                replace_file(target, content, is_lasting=False)
        except OSError as error:
            self._give_up(error)

    def _give_up(self, error: Exception) -> None:
        log.warning("%s: its next process begins anew: %s", self._behavior.name, error)
        self._file.give_up()
