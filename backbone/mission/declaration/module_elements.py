"""The elements of modules and execution units."""

from __future__ import annotations

from pydantic import Field

from backbone.keys import Conversation as ConversationWord
from backbone.mission.declaration.parts import PROCESS, Declared, ParameterElement
from backbone.mission.declaration.values import (
    ClassPath,
    Conversation,
    Flag,
    Frequency,
    MessageBytes,
    Name,
    Names,
    Nice,
    OnInput,
    Processors,
    Seconds,
    SourceAddress,
    Urgency,
)
from backbone.quality import Urgency as UrgencyWord
from backbone.wire import MAX_LARGE_MESSAGE_BYTES


class InputElement(Declared):
    """An input of a module, connected to another key than its class declares."""

    name: Name = Field(description="Name of the input in the module's class.")
    key: Name = Field(description="Key of the output, or of the given values, that the input receives.")


class OutputElement(Declared):
    """An output of a module, published under another key than its class declares."""

    name: Name = Field(description="Name of the output in the module's class.")
    key: Name = Field(description="Its key, unique in the mission.")


class ModuleElement(Declared):
    """An algorithm with declared inputs and outputs; keys and classes determine its connections."""

    name: Name = Field(description="Name of the module, unique in the mission.")
    class_path: ClassPath = Field(
        alias="class", description="Its Python class, written package.module:Class, importable where the file is read."
    )
    parameter: tuple[ParameterElement, ...] = ()
    input: tuple[InputElement, ...] = ()
    output: tuple[OutputElement, ...] = ()


class ChooseElement(Declared):
    """A choice: algorithms for one task run side by side, and one of them is the source of a key."""

    key: Name = Field(description="The key that gets the values; unique in the mission.")
    source: Name = Field(alias="from", description="The key whose values it gets at first.")
    others: Names = Field(
        default=(),
        alias="or",
        description="Keys of the same class that can be chosen instead while the mission runs, separated by blanks.",
    )


class UnitElement(Declared):
    """An execution unit: a component whose modules run one after the other, in rounds.

    Where their connections leave the order open, the modules run in the order of the file.
    """

    name: Name = Field(description="Name of the unit, unique in the mission.")
    frequency_hz: Frequency = Field(
        default=0.0, description="Rounds a second, 0 to 1000; 0: it runs only when an input comes."
    )
    on_input: OnInput = Field(
        default="any",
        description=(
            "When values from outside begin a round: each one (any), a new one for every input (all), or never (none)."
        ),
    )
    own_thread: Flag = Field(
        default=False,
        description="Whether its rounds run in a thread of their own, where they delay nothing else of its process.",
    )
    nice: Nice = Field(
        default=0,
        description="Added to the niceness of its own thread, -20 to 19; above 0: other threads come first.",
    )
    cpus: Processors = Field(
        default="",
        description="Processors that its own thread may run on, as numbers separated by blanks; left out: all.",
    )
    host: Name = Field(default="", description="The host it runs on; left out: any.")
    process: Name = PROCESS
    module: tuple[ModuleElement, ...] = ()
    choose: tuple[ChooseElement, ...] = ()


class GivenElement(Declared):
    """Values that no module of the mission produces, because another component publishes them."""

    key: Name = Field(description="The key under which modules receive them.")
    class_path: ClassPath = Field(alias="class", description="Class of the values, written package.module:Class.")
    address: SourceAddress = Field(description="Address under which they are published, as subsystem/component.")
    conversation: Conversation = Field(
        default=ConversationWord.OUTPUTS, description="The last part of the key under which they are published."
    )


class QualityElement(Declared):
    """How the values of one key travel between units, if not by the defaults of all outputs.

    All attributes apply to an output that a unit publishes. To given values only the deadline applies, because another
    component sends them.
    """

    key: Name = Field(description="The key of an output, or of given values.")
    deadline_s: Seconds = Field(
        default=0.0,
        description="A unit that receives the key from elsewhere logs when no value arrives for so long, and when the "
        "values come again; 0: never.",
    )
    reliable: Flag = Field(
        default=False,
        description="Whether the sender waits for a full queue, up to a second, instead of dropping the value.",
    )
    urgency: Urgency = Field(
        default=UrgencyWord.NORMAL, description="The queue in which values wait: urgent, normal, low or lowest."
    )
    express: Flag = Field(
        default=False,
        description="Whether each value is sent at once, for single small ones; it drops more values of a burst.",
    )
    most_bytes: MessageBytes = Field(
        default=MAX_LARGE_MESSAGE_BYTES,
        description="Longest value, 1 to 67108864; a longer one is refused, and beyond 8388608 it stays on its host.",
    )


class ModulesElement(Declared):
    """The execution units with their modules, and the values given from outside."""

    given: tuple[GivenElement, ...] = ()
    quality: tuple[QualityElement, ...] = ()
    unit: tuple[UnitElement, ...] = ()
