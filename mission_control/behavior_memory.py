"""BehaviorMemory: keeps the progress of a behavior for its next process.

A process that is killed loses what it knew. The behavior's next process continues from a file of the mission's folder
or, on another host, from the placer's copy, if both carry out the same order of the owner: a child that its parent
starts again begins anew.

If the behavior ends again and again without any progress, its memory may be the cause, so it begins anew.
"""

from __future__ import annotations

import asyncio
import logging

import msgspec

from backbone.addresses import PLACER
from backbone.atomic_file import replace_file
from backbone.component.launch import Launch
from backbone.errors import LinkError, Refusal
from backbone.kept_file import KeptFile
from backbone.mission.behavior_orders import TREE_PARAMETERS
from backbone.placer.messages import AskMemory, KeepMemory, Memory, MemoryKept
from mission_control.behavior_hooks import BehaviorHooks
from mission_control.behavior_of_parts import BehaviorOfParts
from mission_control.child_keeper import AGAIN_AFTER_S, REPLY_TIME_S
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
        payload: The last report, encoded, if it is final; else empty.
        children: State of the rules for its children.
        own: Its ``memory_type``, encoded; empty: none.
        kept_s: Mission time of the change.
        recalls: Number of processes that continued from this and did not live for long.
        recalled_s: Mission time of the last of them.
    """

    order_id: str
    parameters: dict[str, object]
    status: BehaviorStatus
    payload: bytes
    children: ChildrenMemory
    own: bytes
    kept_s: float = 0.0
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
        self._kept: KeptBehavior | None = None
        self._unsent: bytes | None = None
        self._sending: asyncio.Task[None] | None = None

    def keep(self) -> None:
        """Replace the kept state by the present one, if it differs and the implementation is in charge."""
        if not self._behavior.gate.is_open or not self._order_id:
            return
        now = self._present()
        if now is not None and now != self._kept:
            self._kept = now
            self._write(msgspec.structs.replace(now, kept_s=self._behavior.clock.now_s()))

    def _present(self) -> KeptBehavior | None:
        """Return the present state; None: it cannot be encoded."""
        of, own = self._behavior, self._hooks.memory()
        try:
            return KeptBehavior(
                order_id=self._order_id,
                parameters=self._parameters(),
                status=of.status,
                payload=msgspec.msgpack.encode(of.payload if of.status.is_final else {}),
                children=self._children.memory(),
                own=b"" if own is None else msgspec.msgpack.encode(own),
            )
        except (TypeError, OverflowError) as error:  # such as a number of numpy in a report
            self._give_up(error)
            return None

    async def recall(self) -> bool:
        """Continue from what the last process kept under this order, if anything; return whether it had finished.

        A class that warms up beside another one continues from that one's state, not from what is kept.
        """
        if self._behavior.gate.is_first and self._order_id:
            left = [kept for kept in (self._read(), await self._left_with_placer()) if kept is not None]
            if self._behavior.status.is_final:  # it was finished meanwhile
                return False
            if left:
                self._continue_from(max(left, key=lambda kept: kept.kept_s))
                return self._behavior.status.is_final
            self._kept = self._present()  # that of a process that knows nothing is not kept
        return False

    def _continue_from(self, kept: KeptBehavior) -> None:
        behavior, now_s = self._behavior, self._behavior.clock.now_s()
        recalls = kept.recalls + 1 if now_s - kept.recalled_s < CALM_S else 1
        if recalls > MOST_RECALLS:
            behavior.publish_event(behavior.name, "begins anew: it ended again and again without progress")
            self._children.begun_anew = kept.children.begun_anew + 1
            return
        self._kept = msgspec.structs.replace(kept, kept_s=0.0, recalls=0, recalled_s=0.0)
        self._write(msgspec.structs.replace(kept, recalls=recalls, recalled_s=now_s))
        behavior.story.note(behavior.name, "continues from the progress of its last process")
        if kept.status.is_final:
            behavior.status, behavior.payload = kept.status, msgspec.msgpack.decode(kept.payload)
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
        given = self._behavior.parameters
        own = (name for name in given.__struct_fields__ if name not in TREE_PARAMETERS)
        return {name: msgspec.to_builtins(getattr(given, name)) for name in own}

    def _read(self) -> KeptBehavior | None:
        try:
            found = self._file.read()
        except OSError as error:
            log.warning("%s: %s", self._file.path, error)
            return None
        return None if found is None else self._decoded(found, f"its file {self._file.path}")

    async def _left_with_placer(self) -> KeptBehavior | None:
        try:
            left = await self._behavior.bus.ask(PLACER, AskMemory(self._order_id), Memory, within_s=REPLY_TIME_S)
        except (LinkError, Refusal) as error:
            log.info("%s: the placer does not answer with its memory: %s", self._behavior.name, error)
            return None
        return self._decoded(left.content, "the placer's copy") if left.content else None

    def _decoded(self, content: bytes, what: str) -> KeptBehavior | None:
        try:
            kept = msgspec.msgpack.decode(content, type=KeptBehavior)
        except msgspec.DecodeError as error:
            log.warning("%s cannot continue from %s: %s", self._behavior.name, what, error)
            return None
        return kept if kept.order_id == self._order_id else None

    def _write(self, kept: KeptBehavior) -> None:
        try:
            content = self._unsent = msgspec.msgpack.encode(kept)
            if (target := self._file.target()) is not None:
                replace_file(target, content, is_lasting=False)
        except (OSError, TypeError, OverflowError) as error:
            self._give_up(error)
        if self._sending is None:
            self._sending = self._behavior.begin_task(self._send(), "memory")

    async def _send(self) -> None:
        """Send the newest state to the placer, until it has it."""
        bus, clock = self._behavior.bus, self._behavior.clock
        while self._unsent is not None:
            content = self._unsent
            try:
                await bus.ask(PLACER, KeepMemory(self._order_id, content), MemoryKept, within_s=REPLY_TIME_S)
            except LinkError:
                await clock.sleep_s(AGAIN_AFTER_S * clock.rate)
                continue
            except Refusal as refusal:
                log.info("%s: the placer does not keep its memory: %s", self._behavior.name, refusal)
            if self._unsent is content:
                self._unsent = None
        self._sending = None

    def _give_up(self, error: Exception) -> None:
        log.warning("%s: its next process begins anew: %s", self._behavior.name, error)
        self._file.give_up()
