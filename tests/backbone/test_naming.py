"""One rule for names."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.incarnation import Incarnation
from backbone.naming import (
    MAX_NAME_LENGTH,
    IllegalName,
    Subsystem,
    address,
    claim_address,
    component_of,
    did_you_mean,
    is_legal,
    legal,
    read_claim,
)

names = st.from_regex(r"[a-z][a-z0-9_-]{0,62}", fullmatch=True)


@given(names)
def test_legal_names_pass_unchanged_and_are_found_in_their_address(name: str) -> None:
    assert legal(name) == name
    assert component_of(address(Subsystem.RESOURCE_POOL, name)) == name


@given(st.text(max_size=70))
def test_a_name_is_legal_by_the_rule_and_refused_otherwise(name: str) -> None:
    if re.fullmatch(r"[a-z][a-z0-9_-]*", name, re.ASCII) and len(name) <= MAX_NAME_LENGTH:
        assert is_legal(name)
    else:
        assert not is_legal(name)
        with pytest.raises(IllegalName):
            legal(name)


@pytest.mark.parametrize("name", ["", "1scout", "Scout", "a b", "a/b", "a*", "scout\n", "ä", "_a", "-a", "a" * 64])
def test_illegal_names(name: str) -> None:
    with pytest.raises(IllegalName):
        address(Subsystem.BACKBONE, name)


@given(names, names, st.integers(1, 2**22), st.integers(0, 2**48 - 1))
def test_a_claim_is_read_back(name: str, host: str, pid: int, start: int) -> None:
    where, holder = address(Subsystem.BACKBONE, name), Incarnation(host, pid, start)
    assert read_claim(claim_address(where, holder)) == (where, holder)


@pytest.mark.parametrize(
    "claim",
    [
        "",
        "backbone/nameserver",
        "a/b/host",
        "a/b/.1.2",
        "a/b/host.",
        "a/b/host.1",
        "a/b/host.x.1",
        "a/b/host.1.x",
        "host.1.2",
    ],
)
def test_what_is_no_claim_is_refused(claim: str) -> None:
    with pytest.raises(IllegalName):
        read_claim(claim)


def test_only_a_near_name_is_suggested() -> None:
    assert did_you_mean("scuot1", ["scout1", "radio"]) == " (did you mean 'scout1'?)"
    assert not did_you_mean("zebra", ["scout1", "radio"])
