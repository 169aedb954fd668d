"""The message classes whose field names a recording contains, by schema.

A package lists its modules with messages as entry points of the group ``scout_backbone.messages``; a kind of RC may
define its commands in the module of its class. Messages of all other classes are recorded without the names of
their fields.
"""

from __future__ import annotations

import importlib
import logging
from collections.abc import Iterable, Iterator
from importlib.metadata import entry_points

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
    for entry in entry_points(group=GROUP):
        entry.load()
    for module in modules:
        try:
            importlib.import_module(module)
        except Exception as error:  # a module that is being written raises anything
            log.warning("messages of %s are recorded without names: %s: %s", module, type(error).__name__, error)
    return {schema_of(kind): kind for kind in _derived(Message)}


def _derived(kind: type[Message]) -> Iterator[type[Message]]:
    for derived in kind.__subclasses__():
        yield derived
        yield from _derived(derived)
