"""Legal names: one rule for components, resources, behaviors, hosts and missions.

A name is a lower-case letter followed by lower-case letters, digits, ``_`` or ``-``, at most
63 characters. Such a name is also a legal key segment, file name and host label, so it needs no quoting.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from enum import StrEnum

from backbone.errors import Refusal
from backbone.incarnation import Incarnation

MAX_NAME_LENGTH = 63  # chosen: the longest label of a host name (RFC 1035), names may become host labels
_HOLDER = re.compile(r"(.+)\.([0-9]{1,7})\.([0-9]{1,15})")  # Linux: PID_MAX_LIMIT is 4194304; 15: six bytes
_COUNTED = re.compile(r"(\D*)(\d{0,18})")  # chosen: a longer number is several
_LEGAL = re.compile(rf"[a-z][a-z0-9_-]{{0,{MAX_NAME_LENGTH - 1}}}")


class Subsystem(StrEnum):
    """The four subsystems; every component belongs to one (RAM 2002, "Distributed Control Architecture")."""

    BACKBONE = "backbone"
    RESOURCE_POOL = "resource_pool"
    MISSION_CONTROL = "mission_control"
    UI_CONSOLE = "ui_console"


class IllegalName(Refusal):
    """The name breaks the rule for names."""

    code = "naming.illegal"
    remedy = "Use a lower-case letter, then lower-case letters, digits, '_' or '-'; at most 63 characters."


def is_legal(name: str) -> bool:
    """Return whether the name follows the rule.

    Example:
        >>> is_legal("scout1"), is_legal("Scout 1")
        (True, False)
    """
    return _LEGAL.fullmatch(name) is not None


def legal(name: str) -> str:
    """Return the name unchanged.

    Raises:
        IllegalName: The name breaks the rule.
    """
    if not is_legal(name):
        raise IllegalName(f"{name!r} is not a legal name")
    return name


def reading_order(name: str) -> list[tuple[str, int]]:
    """Return the key that sorts names or addresses as people count.

    Example:
        >>> sorted(["scout10", "scout2", "scout"], key=reading_order)
        ['scout', 'scout2', 'scout10']
    """
    return [(text, int(digits or 0)) for text, digits in _COUNTED.findall(name)]


def address(subsystem: Subsystem, component: str) -> str:
    """Return the address of a component: ``<subsystem>/<component>``.

    Example:
        >>> address(Subsystem.RESOURCE_POOL, "scout1")
        'resource_pool/scout1'
    """
    return f"{subsystem}/{legal(component)}"


def is_component(component_address: str) -> bool:
    """Return whether a component can have this address.

    Example:
        >>> is_component("resource_pool/scout1"), is_component("anywhere/scout1"), is_component("backbone/No One")
        (True, False, False)
    """
    subsystem, _, name = component_address.partition("/")
    return subsystem in list(Subsystem) and is_legal(name)


def component_of(component_address: str) -> str:
    """Return the component's name, the last segment of its address."""
    return component_address.rpartition("/")[2]


def claim_address(component_address: str, holder: Incarnation) -> str:
    """Return the address of the claim, the token of the incarnation that holds a name, ready or not.

    Example:
        >>> claim_address("resource_pool/scout1", Incarnation("lab-pc", 4242, 9))
        'resource_pool/scout1/lab-pc.4242.9'
    """
    return f"{component_address}/{holder.host}.{holder.pid}.{holder.start}"


def read_claim(claim: str) -> tuple[str, Incarnation]:
    """Return component address and incarnation of a claim's address.

    Example:
        >>> read_claim("resource_pool/scout1/lab-pc.4242.9")
        ('resource_pool/scout1', Incarnation(host='lab-pc', pid=4242, start=9))

    Raises:
        IllegalName: The text is no address of a claim.
    """
    component_address, _, process = claim.rpartition("/")
    found = _HOLDER.fullmatch(process)
    if found is None or not is_component(component_address):
        raise IllegalName(f"{claim!r} is not the address of a claim")
    return component_address, Incarnation(found[1], int(found[2]), int(found[3]))


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return a remark to append to an unknown name: the most similar known name; empty if no name is similar.

    Example:
        >>> did_you_mean("scuot1", ["scout1", "pioneer"])
        " (did you mean 'scout1'?)"
    """
    near = difflib.get_close_matches(name, sorted(known), n=1)
    return f" (did you mean {near[0]!r}?)" if near else ""
