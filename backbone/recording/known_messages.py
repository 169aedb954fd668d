"""The message classes that a recording names the fields of, by schema.

A package names its modules with messages as entry points of the group ``scout_backbone.messages``; a kind of RC may
have its commands beside it in the module of its class. A message of any other class is recorded without names of its
fields.
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

    What these modules import is known too.

    Args:
        modules: Further modules, such as those of the mission's component types; one that is not installed here is
            left out.
    """
    for entry in entry_points(group=GROUP):
        entry.load()
    for module in modules:
        try:
            importlib.import_module(module)
        except ImportError as error:
            log.warning("messages of %s are recorded without names: %s", module, error)
    return {schema_of(kind): kind for kind in _derived(Message)}


def _derived(kind: type[Message]) -> Iterator[type[Message]]:
    for derived in kind.__subclasses__():
        yield derived
        yield from _derived(derived)
