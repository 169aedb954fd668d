"""The message classes whose field names a recording contains, by schema.

A package lists its modules with messages as entry points of the group ``scout_backbone.messages``; a kind of RC may
define its commands in the module of its class. Messages of all other classes are recorded without the names of
their fields, also those of a class of one's own whose name an installed package or another module has taken.
"""

from __future__ import annotations

import importlib
import logging
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator
from importlib.metadata import entry_points

from backbone.errors import complaint
from backbone.wire import Message, schema_of

GROUP = "scout_backbone.messages"

log = logging.getLogger(__name__)


def message_classes(modules: Iterable[str] = ()) -> dict[str, type[Message]]:
    """Return the message classes of the installed packages and of these modules, by schema, ``<Name>/<version>``.

    Message classes that these modules import are included.

    Args:
        modules: Further modules, such as those of the mission's component types; a module that cannot be imported here
            is skipped.
    """
    installed = {entry.module: None for entry in entry_points(group=GROUP)}
    packages = {module.partition(".")[0] for module in installed}
    for module in (*installed, *modules):
        try:
            importlib.import_module(module)
        except (Exception, SystemExit) as error:  # a module that is being written raises anything
            log.warning("messages of %s are recorded without names: %s", module, complaint(error))
    named: dict[str, dict[str, type[Message]]] = defaultdict(dict)
    for kind in filter(_is_in_its_module, _derived(Message)):
        named[schema_of(kind)][f"{kind.__module__}:{kind.__qualname__}"] = kind
    known: dict[str, type[Message]] = {}
    for schema, kinds in named.items():
        only = [path for path in kinds if path.partition(".")[0] in packages] or list(kinds)
        if len(only) == 1:  # else a record would have the names of one class with the values of the other
            known[schema] = kinds[only[0]]
        if len(kinds) > 1:
            nameless = " and ".join(sorted(path for path, kind in kinds.items() if known.get(schema) is not kind))
            log.warning(
                "messages of %s are recorded without names: rename a class, as %s stands twice", nameless, schema
            )
    return known


def _is_in_its_module(kind: type[Message]) -> bool:
    """Return whether the module of the class is there; the types of its fields are found in no other place.

    A class outlives its module for a while if the module's import failed, or its file was read anew in vain.
    """
    return kind.__module__ in sys.modules


def _derived(kind: type[Message]) -> Iterator[type[Message]]:
    for derived in kind.__subclasses__():
        yield derived
        yield from _derived(derived)
