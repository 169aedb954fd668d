"""Laws of the registry, then what happens around a hub's restart."""

from __future__ import annotations

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.component.messages import ComponentState, LastStop, LifeState, NameTaken, StandingStop
from backbone.errors import Refusal
from backbone.incarnation import Incarnation
from backbone.nameserver.messages import Appeared, Disappeared, UnknownName
from backbone.nameserver.registry import CLAIM_WITHIN_S, Announce, Introduce, Registry
from backbone.naming import component_of


def state(
    name: str = "scout1",
    pid: int = 1,
    host: str = "a",
    since_s: float = 0.0,
    subsystem: str = "resource_pool",
    start: int = 0,
) -> ComponentState:
    return ComponentState(f"{subsystem}/{name}", "scout", host, pid, LifeState.CONNECTING, since_s, start=start)


def begun(registry: Registry, who: ComponentState) -> None:
    registry.registered(who, 0.0)
    registry.claim_changed(who.address, who.incarnation, stands=True)


def gone(registry: Registry, who: ComponentState) -> list[object]:
    registry.claim_changed(who.address, who.incarnation, stands=False)
    return list(registry.token_changed(who.address, stands=False, now_s=9.0))


PROCESSES = [state(name, pid, host) for name in ("left", "right") for host in ("a", "b") for pid in (1, 2)]
STEPS = st.lists(
    st.tuples(st.sampled_from(["claim", "register", "ready", "tell", "die"]), st.sampled_from(PROCESSES)), max_size=60
)


@given(STEPS)
def test_a_name_has_one_holder_and_the_dead_are_forgotten(steps: list[tuple[str, ComponentState]]) -> None:
    """Processes register, claim, become ready and die in any order; one that was refused ends."""
    registry = Registry(0.0, 0.0)
    holders: dict[str, ComponentState] = {}
    claimed: set[str] = set()
    ready: set[str] = set()
    for act, who in steps:
        name = component_of(who.address)
        mine = holders.get(name) == who
        match act:
            case "register":
                if name in holders and not mine:
                    with pytest.raises(NameTaken) as taken:
                        registry.registered(who, 0.0)
                    holder = holders[name]
                    assert (taken.value.facts["host"], taken.value.facts["pid"]) == (holder.host, holder.pid)
                else:
                    registry.registered(who, 0.0)
                    holders[name] = who
            case "claim" if mine:
                registry.claim_changed(who.address, who.incarnation, stands=True)
                claimed.add(name)
            case "ready" if mine and name in claimed:
                registry.token_changed(who.address, stands=True, now_s=0.0)
                ready.add(name)
            case "die" if mine and name in claimed:
                del holders[name]
                registry.claim_changed(who.address, who.incarnation, stands=False)
                told = registry.token_changed(who.address, stands=False, now_s=0.0)
                assert told == ([Announce(Disappeared(who.address))] if name in ready else [])
                claimed.discard(name)
                ready.discard(name)
        listed = registry.components("", "", 0.0).components
        assert {(s.address, s.host, s.pid) for s in listed} == {(s.address, s.host, s.pid) for s in holders.values()}
        assert [s.address for s in listed] == sorted(s.address for s in listed)
        assert {component_of(s.address) for s in listed if s.state is LifeState.READY} == ready
    later = {component_of(s.address) for s in registry.components("", "", CLAIM_WITHIN_S).components}
    assert later == claimed


@given(STEPS, st.sampled_from(PROCESSES))
def test_every_question_is_answered_or_refused_whatever_came_before(
    steps: list[tuple[str, ComponentState]], asked: ComponentState
) -> None:
    """No order of tokens, claims, answers and registrations, possible or not, breaks the registry."""
    registry = Registry(0.0, 0.0)
    for act, who in steps:
        try:
            match act:
                case "claim":
                    registry.claim_changed(who.address, who.incarnation, stands=True)
                case "register":
                    registry.registered(who, 0.0)
                case "ready":
                    registry.token_changed(who.address, stands=True, now_s=1.0)
                case "tell":
                    registry.introduced(who)
                case _:
                    gone(registry, who)
        except Refusal:
            continue
    names = {component_of(s.address) for s in registry.components("", "", 2.0).components}
    try:
        assert component_of(registry.resolve(component_of(asked.address), 2.0).address) in names
    except UnknownName:
        assert component_of(asked.address) not in names


def test_a_second_of_the_same_name_is_told_who_has_it() -> None:
    registry = Registry(0.0, 0.0)
    begun(registry, state(pid=7))
    with pytest.raises(NameTaken) as taken:
        begun(registry, state(pid=8, host="b"))
    assert taken.value.facts == {"name": "scout1", "address": "resource_pool/scout1", "host": "a", "pid": 7}


def test_a_name_is_unique_across_subsystems() -> None:
    registry = Registry(0.0, 0.0)
    begun(registry, state())
    with pytest.raises(NameTaken):
        begun(registry, state(subsystem="mission_control", pid=2))


def test_registering_again_after_a_lost_answer_changes_nothing() -> None:
    registry = Registry(0.0, 0.0)
    begun(registry, state())
    registry.registered(state(), 0.0)
    assert registry.resolve("scout1", 1.0) == state()


def test_a_second_component_in_the_same_process_does_not_get_the_name() -> None:
    registry = Registry(0.0, 0.0)
    begun(registry, state(since_s=1.0))
    with pytest.raises(NameTaken):
        begun(registry, state(since_s=2.0))


def test_a_process_that_dies_before_it_is_ready_gives_its_name_back() -> None:
    registry = Registry(0.0, 0.0)
    begun(registry, state(pid=1))
    assert gone(registry, state(pid=1)) == []
    begun(registry, state(pid=2))
    assert registry.resolve("scout1", 1.0).pid == 2


def test_a_process_that_dies_before_its_claim_was_seen_keeps_its_name_for_a_moment_only() -> None:
    registry = Registry(0.0, 0.0)
    registry.registered(state(pid=1), 5.0)
    with pytest.raises(NameTaken):
        registry.registered(state(pid=2), 5.9)
    registry.registered(state(pid=2), 6.0)
    assert registry.resolve("scout1", 6.0).pid == 2


@pytest.mark.parametrize("second_pid", [2, 1], ids=["another pid", "two machines with one host name and equal pids"])
def test_who_comes_back_to_a_name_that_was_given_away_does_not_get_it(second_pid: int) -> None:
    registry = Registry(0.0, 0.0)
    first, second = state(pid=1, start=7), state(pid=second_pid, start=8)
    begun(registry, first)
    registry.token_changed(first.address, stands=True, now_s=1.0)
    gone(registry, first)  # its link is cut
    begun(registry, second)
    registry.token_changed(second.address, stands=True, now_s=1.0)
    registry.claim_changed(first.address, first.incarnation, stands=True)
    registry.token_changed(first.address, stands=True, now_s=2.0)
    assert registry.introduced(first) == []
    assert registry.resolve("scout1", 2.0).incarnation == second.incarnation
    registry.claim_changed(first.address, first.incarnation, stands=False)
    with pytest.raises(NameTaken):
        registry.registered(state(pid=3, start=9), 3.0)


def test_ready_is_announced_at_once_and_the_truth_asked_for() -> None:
    registry = Registry(0.0, 0.0)
    begun(registry, state())
    told = registry.token_changed("resource_pool/scout1", stands=True, now_s=4.0)
    match told:
        case [Announce(news=Appeared(component=component)), Introduce(address="resource_pool/scout1")]:
            assert (component.state, component.since_s) == (LifeState.READY, 4.0)
        case _:
            pytest.fail(f"told {told}")


def test_what_is_said_about_readiness_counts_only_under_a_token() -> None:
    registry = Registry(0.0, 0.0)
    begun(registry, state())
    registry.status_published(ComponentState("resource_pool/scout1", "scout", "a", 1, LifeState.READY, 1.0))
    assert registry.resolve("scout1", 1.0).state is LifeState.CONNECTING
    registry.token_changed("resource_pool/scout1", stands=True, now_s=2.0)
    registry.status_published(ComponentState("resource_pool/scout1", "scout", "a", 1, LifeState.READY, 2.0, "drives"))
    assert registry.resolve("scout1", 2.0).feedback == "drives"


@pytest.mark.parametrize("how", ["published", "introduced"])
def test_the_stop_of_the_last_component_of_a_name_is_kept_and_whether_it_was_lifted(how: str) -> None:
    registry, stop = Registry(0.0, 0.0), StandingStop(3, "anna", "fire", 1.0)
    tell = {"published": registry.status_published, "introduced": registry.introduced}[how]
    first, second = state(), state(pid=2, host="b")
    begun(registry, first)
    registry.token_changed(first.address, stands=True, now_s=1.0)
    tell(msgspec.structs.replace(first, stop=stop, stops=3))
    gone(registry, first)
    begun(registry, second)
    assert (registry.last_stop("scout1"), registry.last_stop("scout2")) == (LastStop(3, stop), LastStop())
    registry.token_changed(second.address, stands=True, now_s=2.0)
    tell(msgspec.structs.replace(second, stops=3))
    assert registry.last_stop("scout1") == LastStop(3)


def test_a_restarted_hub_learns_who_is_behind_the_tokens_that_come_back() -> None:
    registry = Registry(hub_since_s=10.0, reconnect_s=1.0)
    registry.claim_changed("resource_pool/scout1", Incarnation("a", 7), stands=True)
    assert registry.token_changed("resource_pool/scout1", stands=True, now_s=10.1) == [
        Introduce("resource_pool/scout1")
    ]
    with pytest.raises(NameTaken) as taken:
        begun(registry, state(pid=8, host="b"))
    assert (taken.value.facts["host"], taken.value.facts["pid"]) == ("a", 7)
    known = ComponentState("resource_pool/scout1", "scout", "a", 7, LifeState.READY, 3.0)
    assert registry.introduced(known) == [Announce(Appeared(known))]
    assert registry.introduced(known) == []
    assert registry.resolve("scout1", 10.2) == known


def test_absence_proves_nothing_until_the_components_had_time_to_come_back() -> None:
    registry = Registry(hub_since_s=10.0, reconnect_s=1.0)
    assert not registry.components("", "", 10.9).complete
    with pytest.raises(UnknownName) as unknown:
        registry.resolve("scout1", 10.9)
    assert unknown.value.facts["complete"] is False
    assert registry.components("", "", 11.0).complete


def test_a_list_is_incomplete_while_a_token_stands_for_somebody_unknown() -> None:
    registry = Registry(0.0, 0.0)
    registry.token_changed("resource_pool/scout1", stands=True, now_s=5.0)
    assert not registry.components("", "", 5.0).complete
    assert registry.is_unknown("resource_pool/scout1")
    registry.introduction_failed("resource_pool/scout1")
    listed = registry.components("", "", 5.0)
    assert listed.complete
    assert listed.unknown == ["resource_pool/scout1"]
    assert registry.components("backbone", "", 5.0).unknown == []


def test_an_answer_that_comes_after_the_death_is_no_news() -> None:
    registry = Registry(0.0, 0.0)
    registry.token_changed("resource_pool/scout1", stands=True, now_s=5.0)
    assert registry.token_changed("resource_pool/scout1", stands=False, now_s=5.1) == []
    assert registry.introduced(state()) == []
    assert registry.components("", "", 6.0).components == []


def test_an_unknown_name_is_answered_with_the_nearest_known_one() -> None:
    registry = Registry(0.0, 0.0)
    begun(registry, state("scout1"))
    with pytest.raises(UnknownName, match="did you mean 'scout1'"):
        registry.resolve("scuot1", 1.0)


def test_lists_are_narrowed_by_subsystem_and_type() -> None:
    registry = Registry(0.0, 0.0)
    begun(registry, state("scout1"))
    begun(registry, state("watcher", subsystem="mission_control"))
    assert [s.address for s in registry.components("mission_control", "", 1.0).components] == [
        "mission_control/watcher"
    ]
    assert registry.components("", "radio", 1.0).components == []
