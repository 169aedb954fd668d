"""Orders: the declarations of modules and units in a mission file, as plain data; creates the modules from them."""

from __future__ import annotations

from typing import Annotated, TypeGuard

import msgspec

from backbone.errors import Refusal
from backbone.import_faults import import_fault, object_at
from backbone.keys import Conversation
from backbone.naming import did_you_mean
from backbone.quality import Quality
from backbone.ranges import Values
from backbone.reading_anew import WrongClass
from backbone.wire import MAX_LARGE_MESSAGE_BYTES, MAX_MESSAGE_BYTES, Message, OversizedMessage
from mission_control.modules.graph import Member
from mission_control.modules.module import Module
from mission_control.modules.unit_schedule import Trigger


class WrongModule(WrongClass):
    """A class path does not name a module, or the module refuses its parameters."""

    code = "module.class"
    remedy = "Write the class as package.module:Class, importable on the unit's host, and derive it from Module."


UNSENDABLE = "Return fields of the declared types, and memory without gaps."


class ModuleOrder(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A module of a unit.

    Attributes:
        name: Its name, unique in the mission.
        class_path: ``package.module:Class``.
        parameters: Values for its ``Parameters``.
        inputs: Input → key, if it differs from the declared one.
        outputs: Output → key, likewise.
    """

    name: str
    class_path: str
    parameters: Values = {}
    inputs: dict[str, str] = {}
    outputs: dict[str, str] = {}

    def load(self) -> Module:
        """Return the module.

        Raises:
            WrongModule: There is no such class, or it refuses these parameters.
        """
        kind = load_module_class(self.class_path)
        try:
            return kind(msgspec.convert(self.parameters, kind.Parameters))
        except msgspec.ValidationError as error:
            known = [field.name for field in msgspec.structs.fields(kind.Parameters)]
            unknown = next((name for name in self.parameters if name not in known), "")
            raise WrongModule(
                f"{self.name} ({self.class_path}) refuses its parameters: {error}{did_you_mean(unknown, known)}",
                remedy=f"There is: {', '.join(known) or 'none'}; give each a value of its type.",
            ) from None

    def member(self, module: Module | type[Module]) -> Member:
        """Return the module's place in a graph."""
        return Member(self.name, module.ports(), self.inputs, self.outputs)


class Source(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The place of publication of a key's values.

    Attributes:
        address: ``<subsystem>/<component>``, and the key of an output.
        conversation: Conversation of the publications.
    """

    address: str
    conversation: Conversation = Conversation.OUTPUTS


class Running(Trigger, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Condition and place of a unit's rounds.

    Attributes:
        own_thread: True: the rounds run in their own thread beside the event loop.
        nice: Added to the niceness of that thread.
        cpus: Processors on which it may run; empty: all.
    """

    own_thread: bool = False
    nice: Annotated[int, msgspec.Meta(ge=-20, le=19)] = 0
    cpus: list[Annotated[int, msgspec.Meta(ge=0)]] = []

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.nice or self.cpus) and not self.own_thread:
            raise ValueError("niceness and processors are those of a thread; let the unit have a thread of its own")


class UnitParameters(Running, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Parameters of the component that runs a unit.

    Attributes:
        modules: Modules of the unit.
        sources: Key → source of its values, for keys that the unit does not produce itself.
        published: Keys of the published outputs.
        qualities: Key of an output or source → quality of its transport, if it differs from the default.
        chosen: Key → chosen source, if it is not the first one of a ``SourceChoice``; settable.
    """

    modules: list[ModuleOrder]
    sources: dict[str, Source] = {}
    published: list[str] = []
    qualities: dict[str, Quality] = {}
    chosen: dict[str, str] = {}


def output_address(unit: str, key: str) -> str:
    """Return the address under which a unit publishes an output.

    Example:
        >>> output_address("mission_control/vision", "ball")
        'mission_control/vision/ball'
    """
    return f"{unit}/{key}"


def is_message(kind: object) -> TypeGuard[type[Message]]:
    """Return whether values of this class can cross the bus."""
    return isinstance(kind, type) and issubclass(kind, Message)


def load_at(class_path: str) -> object:
    """Return the object at ``package.module:Class``; imports its file.

    Raises:
        WrongModule: There is no such object, or the file cannot be imported.
    """
    try:
        found: object = object_at(class_path)
    except Exception as error:  # a file that is just being written may raise any exception
        told, remedy = import_fault(class_path, error)
        raise WrongModule(told, remedy=remedy, class_path=class_path) from error
    return found


def load_module_class(class_path: str) -> type[Module]:
    """Return the module class at ``package.module:Class``; imports its file.

    Raises:
        WrongModule: No module class has this path.
    """
    found = load_at(class_path)
    if not (isinstance(found, type) and issubclass(found, Module)):
        raise WrongModule(f"{class_path} is no module", class_path=class_path)
    return found


def unsendable(told: str, key: str, error: Exception) -> WrongModule:
    """Return the refusal of a value that cannot be sent at its key because of this error.

    Args:
        told: The value, as the begin of a sentence.
    """
    cause = error.detail if isinstance(error, Refusal) else error
    remedy = error.remedy if isinstance(error, Refusal) else UNSENDABLE
    limits = (MAX_MESSAGE_BYTES, MAX_LARGE_MESSAGE_BYTES)
    if isinstance(error, OversizedMessage) and error.facts.get("most_bytes") not in limits:
        declared = f'<quality key="{key}" most-bytes="{error.facts.get("bytes")}"/>'
        remedy = f"Declare {declared} or more in the mission file, or send less in one value."
    return WrongModule(f"{told} cannot be sent: {cause}", remedy=remedy)
