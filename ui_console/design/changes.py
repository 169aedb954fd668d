"""Effect of a page's change on a draft, and the sections of the view for all pages.

Pure: from a draft and a change to another draft or a typed refusal; from a draft to sections as JSON.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path as FilePath
from typing import assert_never

import msgspec

from backbone.mission.class_facts import ClassFacts
from backbone.mission.edit import Path
from ui_console.design.commands import DesignRefused
from ui_console.design.draft import Draft
from ui_console.design.effects import relocate, remove
from ui_console.design.following import follower
from ui_console.design.offers import Offer, offer_at
from ui_console.design.properties import Property, properties
from ui_console.design.protocol import Change, MoveElement, Redo, RemoveElement, SetProperty, TakeOffer, Undo
from ui_console.design.views import palette, places, problems_view, tree_view

_FILE_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*\.xml")


class ChangedMeanwhile(DesignRefused):
    """The draft is not the revision that the change names."""

    code = "design.changed_meanwhile"
    remedy = "Look at the mission as it is now, and repeat the change if you still want it."


class MustAsk(DesignRefused):
    """The addition needs answers first.

    Attributes:
        offer: The offer with its questions.
    """

    code = "design.must_ask"
    remedy = "Answer the questions of the addition."

    def __init__(self, offer: Offer) -> None:
        super().__init__(f"{offer.label} asks for: {', '.join(one.name for one in offer.asks)}")
        self.offer = offer


def changed(draft: Draft, change: Change) -> Draft:
    """Return the draft after a change; if it changes nothing, return the same draft.

    Raises:
        MustAsk: The addition needs answers first.
        Refusal: The change is not possible; see ``Draft.do``.
    """
    match change:
        case TakeOffer(path=path, label=label, answers=answers):
            offer = offer_at(draft.mission, path, label)
            if offer.must_ask and not answers:
                raise MustAsk(offer)
            return draft.do(offer.command(answers))
        case SetProperty(path=path, value=value):
            return draft.do(_property(draft, change).command(path, draft.mission.at(path).tag, value.strip()))
        case MoveElement(path=path, parent=parent, before=before):
            return draft.do(relocate(path, parent, _place(draft, path, parent, before)))
        case RemoveElement(path=path):
            return draft.do(remove(path))
        case Undo():
            return draft.undo()
        case Redo():
            return draft.redo()
        case _:
            assert_never(change)


def touched_by(change: Change, before: Draft, after: Draft) -> Path:
    """Return the path of the changed element after the change; for a parameter, the path of its element."""
    if isinstance(change, Undo):
        path = follower(before, after)(before.mission.nearest(before.step.touched))
    else:
        path = after.mission.nearest(after.step.touched)
    return path[:-1] if after.mission.at(path).tag == "parameter" else path


def sibling_file(source: str, name: str) -> FilePath:
    """Return the path of a mission file in the folder of another one; an empty name means that other file.

    Raises:
        DesignRefused: The name is not a legal name of a mission file.
    """
    if not name:
        return FilePath(source)
    if not _FILE_NAME.fullmatch(name):
        raise DesignRefused(
            f"{name!r} is no name of a mission file", remedy="Write letters, digits, '.', '_', '-', and end in .xml."
        )
    return FilePath(source).with_name(name)


def sections(draft: Draft, facts: Mapping[str, ClassFacts]) -> dict[str, bytes]:
    """Return the sections of a draft's view for all pages, as JSON by name.

    Args:
        facts: Class path → facts of the class.
    """
    told = {
        "tree": tree_view(draft),
        "problems": problems_view(draft),
        "palette": palette(draft.mission, facts),
        "places": places(),
    }
    return {name: msgspec.json.encode(view) for name, view in told.items()}


def _property(draft: Draft, change: SetProperty) -> Property:
    """Return the property to set; a name unknown to the class may still be set as a parameter."""
    node = draft.mission.at(change.path)
    for one in properties(draft.mission, node, {}):
        if (one.name, one.is_parameter) == (change.name, change.is_parameter):
            return one
    return Property(change.name, None, None, is_missing=False, is_parameter=change.is_parameter, doc="")


def _place(draft: Draft, path: Path, parent: Path, before: int | None) -> int:
    """Return the new number of an element among its siblings, not counting the element itself."""
    count = len(draft.mission.at(parent).children)
    number = count if before is None else before
    is_later_sibling = bool(path) and parent == path[:-1] and number > path[-1]
    return number - is_later_sibling
