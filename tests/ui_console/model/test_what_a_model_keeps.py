"""What the model of a team keeps of consoles that left: of a long mission no more than of a short one."""

from __future__ import annotations

import gc
import sys

import pytest
from console_scenes import COMPONENTS, component, model, rc, request

from backbone.component.messages import LifeState
from backbone.nameserver.messages import Components, Disappeared
from backbone.scheduling.requests import Holder, RequestState
from backbone.scheduling.views import Schedule
from backbone.shipped import PACKAGES
from ui_console.model.console import ConsoleModel
from ui_console.model.events import Heard

RCS = [rc("scout1", "scout", []), rc("scout2", "scout", [])]


def come_and_go(shown: ConsoleModel, visits: range, *, last_words_first: bool) -> None:
    """Let consoles with names of their own take a robot one after the other, and leave."""
    for visit in visits:
        at_s, owner, arc = 10.0 * visit, f"ui_console/console-{visit}", f"console-{visit}-capture"
        both = [(owner, "console", "backbone/launcher"), (f"resource_pool/{arc}", "capture", owner)]
        for address, kind, requester in both:
            shown.apply(Heard(at_s, component(address, kind, requester=requester)))
        wish = request(arc, owner, RequestState.RUNNING, priority=f"console-{visit}:100")
        held = [rc("scout1", "scout", [Holder(arc, visit, at_s, at_s + 9.0)]), RCS[1]]
        shown.apply(Heard(at_s, Schedule(at_s, held, [wish], [])))
        for address, kind, requester in both:
            ends = [component(address, kind, state=state, requester=requester) for state in (LifeState.DRAINING,)]
            last = component(address, kind, state=LifeState.STOPPED, requester=requester)
            said = [*ends, last, Disappeared(address)] if last_words_first else [*ends, Disappeared(address), last]
            for one in said:
                shown.apply(Heard(at_s + 9.0, one))
        shown.apply(Heard(at_s + 9.1, Schedule(at_s + 9.1, held, [wish], [])))  # the RC manager heard of it later
        shown.apply(Heard(at_s + 9.2, Schedule(at_s + 9.2, RCS, [], [])))
        shown.apply(Heard(at_s + 9.3, Components(COMPONENTS, True, 0.0)))


def names_of_consoles(root: object) -> int:
    """Return the number of names and addresses of consoles and of their ARCs in an object and all that it has.

    Modules that are not the product's are left out: from them all objects of all tests are reached.
    """
    others = [vars(module) for name, module in [*sys.modules.items()] if name.partition(".")[0] not in PACKAGES]
    seen, pending, found = {id(root), *map(id, others)}, [root], 0
    while pending:
        for one in gc.get_referents(pending.pop()):
            if id(one) not in seen and not isinstance(one, type):
                seen.add(id(one))
                pending.append(one)
                found += isinstance(one, str) and one.rpartition("/")[2].startswith("console-")
    return found


@pytest.mark.parametrize("last_words_first", [True, False])
def test_of_consoles_that_left_a_model_has_no_name_beyond_its_timeline(last_words_first: bool) -> None:
    shown = model(Heard(0.0, Components(COMPONENTS, True, 0.0)))
    come_and_go(shown, range(100), last_words_first=last_words_first)
    before = names_of_consoles(shown)
    come_and_go(shown, range(100, 300), last_words_first=last_words_first)
    assert names_of_consoles(shown) <= before
