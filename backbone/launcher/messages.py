"""Messages about the behavior tree of a running mission.

They go to the launcher, which owns the tree, and from it to behaviors.
"""

from __future__ import annotations

from typing import Annotated, Any

from backbone.errors import Refusal
from backbone.ranges import MANY, Count, Document, Line, Mention, Text, Values
from backbone.wire import Message


class AskTree(Message, frozen=True):
    """Ask for the mission as it is now."""


class Tree(Message, frozen=True):
    """Answer to ``AskTree``.

    Attributes:
        version: Number of changes since the mission came up.
        text: The mission file with these changes.
    """

    version: Count
    text: Document


# Changes.


class AddBranch(Message, frozen=True):
    """Add a branch to the running tree.

    Attributes:
        version: Version of the tree that the operator saw; each change carries it.
        parent: The new parent behavior; the mission's name: the branch becomes a root.
        branch: Its XML: one ``<behavior>`` with all that is in it.
        source: Name of the branch's file, for faults.
        place: Its number among its siblings, from 1 to their number and one; 0: the last.
    """

    version: Count
    parent: Mention
    branch: Document
    source: Line
    place: Count = 0


class RemoveBranch(Message, frozen=True):
    """End a behavior and its descendants, and remove them from the tree."""

    version: Count
    name: Mention


class MoveBranch(Message, frozen=True):
    """Move a branch.

    Below the same parent, only its place among its siblings changes. Below another parent, the branch ends and starts
    again there, because its path changes.

    Attributes:
        place: As in ``AddBranch``.
    """

    version: Count
    name: Mention
    parent: Mention
    place: Count = 0


class ReplaceBranch(Message, frozen=True):
    """End a behavior and its descendants; another branch starts in its place.

    Attributes:
        branch: As in ``AddBranch``.
        source: As in ``AddBranch``.
    """

    version: Count
    name: Mention
    branch: Document
    source: Line


class SetInTree(Message, frozen=True):
    """Change a value of one behavior, now and for each later start.

    Attributes:
        parameter: ``priority``, ``minimum_runtime_s``, ``maximum_runtime_s``, or a parameter of the behavior.
        value: The new value.
    """

    version: Count
    name: Mention
    parameter: Mention
    value: Any


TreeChange = AddBranch | RemoveBranch | MoveBranch | ReplaceBranch | SetInTree


class TreeChanged(Message, frozen=True):
    """Answer to a change: the tree is changed as ordered.

    Attributes:
        version: The new version of the tree.
        remarks: Further effects, for the operator, one line each.
    """

    version: Count
    remarks: Annotated[list[Text], MANY] = []


class TreeChangedMeanwhile(Refusal):
    """The tree has changed since the operator read it; this change had no effect."""

    code = "tree.changed_meanwhile"
    remedy = "Read the tree again with 'scout-backbone tree', then decide again."


class TreeInvalid(Refusal):
    """This change would make the mission file invalid; nothing is changed. The detail has one fault a line."""

    code = "tree.invalid"
    remedy = "Correct the faults; the mission runs on unchanged."


class UnknownBehavior(Refusal):
    """The tree has no behavior of this name."""

    code = "tree.unknown"
    remedy = "See 'scout-backbone tree' for the names of all behaviors."


class NotUpYet(Refusal):
    """The mission is coming up or ending; its tree cannot be changed now."""

    code = "tree.not_up"
    remedy = "Try again when 'scout-backbone status' shows the mission."


# To a behavior.


class TakeBranch(Message, frozen=True):
    """The tree has changed at or around a behavior. The behavior ends the children that it no longer has.

    Attributes:
        version: Version of the tree; a behavior that knows a later version changes nothing.
        place: The new values of its parameters ``path``, ``arc`` and ``children``.
        anew: Names of children that end and start again, because their declarations are new.
    """

    version: Count
    place: Values
    anew: Annotated[list[Mention], MANY] = []


class BranchTaken(Message, frozen=True):
    """Answer to ``TakeBranch``: the removed children have ended.

    Attributes:
        finished: The behavior's final status; a finished behavior starts no children. Empty: it runs.
    """

    finished: Mention = ""
