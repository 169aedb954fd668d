"""The program that imports classes and prints their facts, one JSON line for each; see ``class_asking``."""

from __future__ import annotations

import faulthandler
import inspect
import os
import sys
import time
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import msgspec

from backbone.component.abilities import Abilities
from backbone.component.class_faults import class_faults, untyped_fields
from backbone.component.component import AnyComponent, Component
from backbone.component.field_docs import field_docs
from backbone.component.messages import CommonQuestion
from backbone.errors import Refusal, complaint, own_place
from backbone.import_faults import object_at
from backbone.mission.arranged import Arranged, UnitsQuestion
from backbone.mission.class_facts import PLANNER, ClassFacts, ParameterFacts, Question, parameters_of
from backbone.scheduling.own_planner import load_planner
from backbone.wire import Message, kinds_of, schema_of

BY_CLASS_ALONE = ("multipleOf", "format", "contentEncoding")  # rules of a schema that ``ParameterFacts`` lacks
ASK_POSE = "AskPose"  # the question to localizers, which the resource pool declares
SOON_S = 0.001  # chosen: the shortest; a process that started so late has no time for an import
ALIKE_MOST = 16  # measured: 16 watchers take a twentieth of a core; a hang or kill of their process ends no more


def facts_of(asked: str) -> ClassFacts:
    """Return the facts of a class, a class with its driver or body, or a planner, as ``Tables`` writes the question.

    Imports the modules into this process.
    """
    class_path, _, driver = asked.partition(" ")
    if class_path == PLANNER:
        return ClassFacts(failure=_planner_fault(driver))
    try:
        found = object_at(class_path)
    except BaseException as error:  # a module that is being written raises anything, or ends as a program does
        return ClassFacts(failure=f"its module cannot be imported: {_told(error)}")
    if not (isinstance(found, type) and issubclass(found, Component)):
        return ClassFacts(failure="it is no component: it does not derive from backbone.component.component:Component")
    if faults := "; ".join(class_faults(found)) or _commands_fault(found):
        return ClassFacts(failure=faults)
    try:
        facts = _described(found, driver)
    except Refusal as error:
        return ClassFacts(failure=error.detail)
    except Exception as error:  # a type of a parameter without a schema, or a hook of the class with a bug
        told = _without_schema(found) or _told(error)
        return ClassFacts(failure=f"its parameters or abilities cannot be listed: {told}")
    limits = _limits_faults(getattr(found, "limits", {}), facts.abilities)
    return ClassFacts(failure=limits) if limits else facts


def _commands_fault(found: type[AnyComponent]) -> str:
    """Return the first command that is no message, has a field without a type, or the name of another message."""
    declared = getattr(found, "commands", None) or ()
    commands = declared if isinstance(declared, Collection) else kinds_of(declared)
    asked = CommonQuestion if found.accepts is None else CommonQuestion | found.accepts
    schemas = {schema_of(kind): kind for kind in kinds_of(asked) if kind not in commands}
    for kind in commands:
        if not (isinstance(kind, type) and issubclass(kind, Message)):
            return f"commands has {getattr(kind, '__name__', kind)}, which is no command; derive it from Command"
        if (other := schemas.setdefault(schema_of(kind), kind)) is not kind:
            return f"commands has {kind.__module__}:{kind.__name__}, and {other.__module__} has a message of this name"
        for fault in untyped_fields(kind):
            return fault
    return ""


def _limits_faults(limits: Mapping[str, tuple[float, float]], abilities: Abilities) -> str:
    """Return the limits that narrow no field of a command, so that the hardware would get values beyond them."""
    fields = {field.name for command in abilities.commands for field in command.fields}
    of_nothing = [f"limits has {name!r}, which no command has" for name in limits if name not in fields]
    empty = [f"limits of {name}: {least:g} is above {most:g}" for name, (least, most) in limits.items() if least > most]
    return "; ".join(of_nothing + empty)


def _told(error: BaseException) -> str:
    return complaint(error if own_place(error) else error.with_traceback(None))  # no place in our own code


def _without_schema(found: type[AnyComponent]) -> str:
    """Return the first parameter of a type that no message carries; empty: there is none."""
    try:
        for field in msgspec.structs.fields(found.parameters_type):
            try:
                msgspec.json.schema(field.type)
            except TypeError as error:
                return f"parameter {field.name}: {_told(error)}"
    except Exception:  # the fault is in the class as a whole; the caller reports it
        return ""
    return ""


def _planner_fault(class_path: str) -> str:
    try:
        planner: object = load_planner(class_path)
    except Refusal as error:
        return error.detail
    return "; ".join(f"{class_path}: {fault}" for fault in class_faults(planner)) if isinstance(planner, type) else ""


def _described(found: type[Component[Any]], driver: str) -> ClassFacts:
    own = tuple(one for one in _documented(found.parameters_type) if one.name not in found.given_elsewhere)
    options = found.driver_options(driver) if driver else found.driver_options()
    return ClassFacts(
        inspect.getdoc(found) or "",
        own,
        None if options is None else {driver: _documented(struct) for driver, struct in options.items()},
        getattr(found, "driver_field", "driver"),
        _has_rules(found.parameters_type),
        children=getattr(found, "children_allowed", None),
        may_claim=getattr(found, "may_claim", True),
        needs_arc=getattr(found, "needs_arc", ""),
        abilities=found.abilities(),
        given=tuple(sorted(found.given_elsewhere)),
        shares_process=found.shares_process,
        roles=getattr(found, "kinds", dict)(),
        locates=found.accepts is not None and ASK_POSE in {kind.__name__ for kind in kinds_of(found.accepts)},
        alike_most=max(1, found.alike_most or (ALIKE_MOST if found.shares_process else 1)),
    )


def _has_rules(struct: type[msgspec.Struct]) -> bool:
    """Return whether only the class can judge its values; a word too many here costs one question."""
    declared = msgspec.json.encode(msgspec.json.schema(struct)).decode()
    return hasattr(struct, "__post_init__") or any(f'"{word}":' in declared for word in BY_CLASS_ALONE)


def _documented(struct: type[msgspec.Struct]) -> tuple[ParameterFacts, ...]:
    docs = field_docs(struct)
    return tuple(msgspec.structs.replace(one, doc=one.doc or docs.get(one.name, "")) for one in parameters_of(struct))


def refusal(question: Question) -> str:
    """Return the class's objection to its own parameters among these; empty: none."""
    struct = object_at(question.class_path).parameters_type
    own = {field.encode_name for field in msgspec.structs.fields(struct)}
    try:
        msgspec.convert({key: value for key, value in question.values.items() if key in own}, struct)
    except msgspec.ValidationError as error:
        return str(error)
    except Exception as error:  # a rule of the class with a bug, with which its component could not start either
        return _told(error)
    return ""


def arranged(question: UnitsQuestion) -> Arranged:
    """Return the arrangement of these units by the class that runs execution units."""
    answer: Arranged = object_at(question.class_path).arrange(question)
    return answer


def _answer(what: str, about: Sequence[str]) -> None:
    """Print each answer on a line as soon as it is known; the output of the modules is discarded."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    for one in about:
        answer: object
        match what:
            case "facts":
                answer = facts_of(one)
            case "arrange":
                answer = arranged(msgspec.json.decode(one, type=UnitsQuestion))
            case _:
                answer = refusal(msgspec.json.decode(one, type=Question))
        answers.write(msgspec.json.encode(answer) + b"\n")
        answers.flush()


if __name__ == "__main__":
    left_s = max(SOON_S, float(sys.argv[2]) - time.monotonic())
    faulthandler.dump_traceback_later(left_s)  # the asking process prints the line at which the class hangs
    _answer(sys.argv[1], sys.stdin.buffer.read().decode().split("\0"))
    os._exit(0)  # a thread that a module started at its import may never end
