"""Composites of three children that have begun."""

from __future__ import annotations

from typing import Any

from composed_trees import decide

from mission_control.children import Children, Instruction
from mission_control.composites import WhileSuspended
from mission_control.messages import BehaviorStatus

SUCCESS, FAILURE, RUNNING = BehaviorStatus.SUCCESS, BehaviorStatus.FAILURE, BehaviorStatus.RUNNING
NAMES = ["a", "b", "c"]
FAIL: dict[str, Any] = {"while_suspended": WhileSuspended.FAIL, "patience_s": 2.0}
SKIP: dict[str, Any] = {"while_suspended": WhileSuspended.SKIP, "patience_s": 2.0}


def begun(rules: Children) -> Children:
    rules.begin(0.0)
    return rules


def end(rules: Children, name: str, status: BehaviorStatus, now: float = 0.0, **payload: object) -> list[Instruction]:
    assert rules.reported(name, status, payload)
    return decide(rules, name, now)
