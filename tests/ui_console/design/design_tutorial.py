"""The mission that the design tutorial builds, and classes that say little of themselves."""

from __future__ import annotations

from backbone.mission.class_facts import ClassFacts, ParameterFacts
from backbone.mission.edit import Element, NewElement
from ui_console.design.draft import Draft
from ui_console.design.effects import add, add_behavior, add_resource, add_world, claim_arc, set_value

WATCH = "mission_control.behaviors.watch_for_motion:WatchForMotion"
VIEW_S = {"type": "number", "minimum": 0, "default": 0.0}
FACTS = {
    WATCH: ClassFacts("Looks for motion.", (ParameterFacts("view_s", VIEW_S, "For how long what moves is in view."),))
}


def tutorial_draft(source: str = "guard.xml") -> Draft:
    """Return the mission of the design tutorial, as every pointer has to build it."""

    def path_of(tag: str, name: str) -> tuple[int, ...]:
        return next(node.path for node in draft.mission if (node.tag, node.text("name")) == (tag, name))

    draft = Draft.new(source).do(add_world("9", "6"))
    points = [NewElement("point", {"x-m": x, "y-m": "3"}) for x in ("0", "9")]
    pioneer = {"name": "pioneer", "shape": "pioneer", "speed-m-s": "0.5"}
    draft = draft.do(add(path_of("world", "world"), NewElement("target", pioneer, points)))
    for kind, name in (("command_radio", "radio"), ("video_frequency", "video1"), ("framegrabber", "grabber")):
        draft = draft.do(add_resource(kind, name))
    for name in ("scout1", "scout2"):
        draft = draft.do(add_resource("scout", name))
    draft = draft.do(set_value(path_of("robot", "scout2"), "x-m", "7.2"))
    draft = draft.do(add_behavior((), "surveillance", "surveillance", 5))
    for robot in ("scout1", "scout2"):
        draft = draft.do(add_behavior(path_of("behavior", "surveillance"), "watch_for_motion", f"watch-{robot}"))
        draft = draft.do(claim_arc(draft.step.touched, "capture", "5"))
        draft = draft.do(add(draft.step.touched, NewElement("wish", {"type": "scout", "name": robot})))
    return draft


def element(draft: Draft, tag: str, name: str) -> Element:
    """Return the one element of this tag and name."""
    (found,) = [node for node in draft.mission if (node.tag, node.text("name")) == (tag, name)]
    return found
