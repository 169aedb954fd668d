"""Faults of a component's class that show without an instance of it.

A caller that expects a plain method does not await an async one, which then does nothing. A hook with a misspelt name
is never called. An object lacks attributes if its constructor does not call that of the base class. Parameters that
only the type checker knows are never read.
"""

from __future__ import annotations

import ast
import inspect
import itertools
import typing
from collections.abc import Iterator
from pathlib import Path

import msgspec

LEAST_LETTERS = 6  # chosen: shorter words often differ in a letter, as act and fact, see and seek; see ``_is_slip``


def class_faults(kind: type) -> Iterator[str]:
    """Yield a sentence, with the remedy, for each fault.

    Example:
        >>> class Base:
        ...     def see(self, frame): ...
        >>> class Own(Base):
        ...     async def see(self, frame): ...
        >>> list(class_faults(Own))
        ["see is an 'async def'; write it as a 'def', as the base class does"]
    """
    for name in dir(kind):
        definitions = [vars(one)[name] for one in kind.__mro__ if name in vars(one)]
        own, base = definitions[0], definitions[-1]
        if own is not base and not name.startswith("__"):
            yield from fault_of_method(name, own, base, "the base class")
    yield from _of_names(kind)
    yield from _of_constructors(kind)
    yield from _of_parameters(kind)
    yield from _of_answers(kind)


def fault_of_method(name: str, own: typing.Any, base: typing.Any, whose: str) -> Iterator[str]:
    """Yield a sentence if a call that suits the method ``base`` does not suit ``own``; other attributes have no fault.

    Args:
        whose: The class of ``base``, for people.
    """
    if not (inspect.isfunction(own) and inspect.isfunction(base)):
        return
    if _can_be_awaited(base) and not _can_be_awaited(own):
        yield f"{name} is a 'def'; write it as an 'async def', as {whose} does"
    elif _can_be_awaited(own) and not _can_be_awaited(base):
        yield f"{name} is an 'async def'; write it as a 'def', as {whose} does"
    else:
        given = inspect.signature(base).parameters.values()
        by_place = [one.name for one in given if one.kind is one.POSITIONAL_OR_KEYWORD and one.default is one.empty]
        by_name = [one.name for one in given if one.kind is one.KEYWORD_ONLY]
        try:
            inspect.signature(own).bind(*by_place, **dict.fromkeys(by_name))
        except TypeError as error:
            yield f"{name}: {error}; {whose} has {name}({', '.join(by_place + [f'{one}=…' for one in by_name])})"


def _can_be_awaited(function: typing.Any) -> bool:
    """Return whether the result can be awaited, as far as the declaration shows it."""
    plain = inspect.unwrap(function)
    result = str(inspect.signature(plain).return_annotation)
    return inspect.iscoroutinefunction(plain) or any(word in result for word in ("Awaitable", "Coroutine", "Future"))


def _of_names(kind: type) -> Iterator[str]:
    """Yield a fault for each new method whose name looks like that of a method that its class does not override."""
    methods = [name for name in dir(kind) if name[0] != "_" and inspect.isfunction(getattr(kind, name))]
    makers = {name: [one for one in kind.__mro__ if name in vars(one)] for name in methods}
    for own, base in itertools.permutations(methods, 2):
        maker, meant = makers[own][0], makers[base][0]
        is_new = len(makers[own]) == 1 and maker is not meant and issubclass(maker, meant)
        if is_new and (_is_misspelt(own, base) or (_is_slip(own, base) and _is_unused(own, maker))):
            yield f"{own} looks like {base} misspelt, which is not overridden; write {base}, or a less similar name"


def _is_misspelt(name: str, other: str) -> bool:
    """Return whether one letter of a long name is wrong, missing, too many, or in another place.

    The last letter must be right: ``resume`` is another word than ``resumed``.
    """
    if len(other) < LEAST_LETTERS or name[-1] != other[-1]:
        return False
    return not {name, *_without_a_letter(name)}.isdisjoint({other, *_without_a_letter(other)})


def _is_slip(name: str, other: str) -> bool:
    """Return whether a short name has one letter doubled or missing, or two letters exchanged.

    Example:
        >>> [name for name in ("actt", "at", "atc", "fact", "ask") if _is_slip(name, "act")]
        ['actt', 'at', 'atc']
    """
    places = range(len(other))
    doubled = {other[: at + 1] + other[at:] for at in places}
    exchanged = {other[:at] + other[at + 1 : at + 2] + other[at] + other[at + 2 :] for at in places}
    return len(other) < LEAST_LETTERS and name in doubled.union(exchanged, _without_a_letter(other))


def _is_unused(name: str, kind: type) -> bool:
    """Return whether the file of the class uses the name nowhere, so that only a base class could call the method."""
    try:
        tree = ast.parse(Path(inspect.getfile(kind)).read_text())
    except (OSError, TypeError, SyntaxError, ValueError):  # a class that was made without a file, or of a broken one
        return False
    return not any(name in (getattr(node, "attr", ""), getattr(node, "id", "")) for node in ast.walk(tree))


def _without_a_letter(name: str) -> list[str]:
    return [name[:index] + name[index + 1 :] for index in range(len(name))]


def _of_constructors(kind: type) -> Iterator[str]:
    """Yield a fault for each constructor that cannot call that of its base class, or cannot be called like it.

    A base class that can be made without arguments, as modules are, leaves them to the derived class.
    """
    made = [one for one in kind.__mro__ if inspect.isfunction(vars(one).get("__init__")) and not _is_protocol(one)]
    own, base = (vars(one)["__init__"] for one in (made[0], made[-1])) if made else (None, None)
    if base is not None and any(one.default is one.empty for one in [*inspect.signature(base).parameters.values()][1:]):
        yield from fault_of_method("__init__", own, base, "the base class")
    for one in made[:-1]:
        constructor = inspect.unwrap(vars(one)["__init__"])
        if not {"super", "__init__"} & set(constructor.__code__.co_names):
            yield f"__init__ of {one.__name__} does not call super().__init__; call it first, with the same arguments"


def _is_protocol(kind: type) -> bool:
    return bool(vars(kind).get("_is_protocol"))


def _of_answers(kind: type) -> Iterator[str]:
    """Yield a fault if the class accepts questions, and only the class that declares ``answer`` would answer them."""
    accepted = getattr(kind, "accepts", None)
    if accepted is not None and sum("answer" in vars(one) for one in kind.__mro__) == 1:
        asked = getattr(accepted, "__name__", accepted)
        yield f"accepts has {asked}, and no answer replies; write 'async def answer(self, asked)'"


def _of_parameters(kind: type) -> Iterator[str]:
    """Yield a fault if the class in the brackets of the base class is not the one from which parameters are read."""
    taken = getattr(kind, "parameters_type", None)
    yield from untyped_fields(taken)
    written = (base for one in kind.__mro__ for base in vars(one).get("__orig_bases__", ()))
    for base in written:
        named = [one for one in typing.get_args(base) if isinstance(one, type) and issubclass(one, msgspec.Struct)]
        if named and hasattr(typing.get_origin(base), "parameters_type"):
            if taken is not None and not issubclass(taken, named[0]):
                word = named[0].__name__
                yield f"it has {word} in brackets and reads {taken.__name__}; write 'parameters_type = {word}' in it"
            return


def untyped_fields(struct: object) -> Iterator[str]:
    """Yield a fault for each value of a struct that is no field of it, because it has no type.

    Example:
        >>> class Turning(msgspec.Struct):
        ...     turns = 3
        >>> list(untyped_fields(Turning))
        ['Turning.turns has no type, so it is no field; write turns: int = 3']
    """
    for one in inspect.getmro(struct) if isinstance(struct, type) else ():
        for name, value in vars(one).items():
            if type(value) in (bool, int, float, str) and _is_new(name, one):
                written = f"{name}: {type(value).__name__} = {value!r}"
                yield f"{one.__name__}.{name} has no type, so it is no field; write {written}"


def _is_new(name: str, struct: type) -> bool:
    """Return whether neither the struct nor a base class declares a type for this name, and it is no constant."""
    declared = any(name in vars(one).get("__annotations__", ()) for one in struct.__mro__)
    return not (declared or name.startswith("_") or name.isupper())
