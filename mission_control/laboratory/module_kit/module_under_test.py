"""A module that a test feeds by hand, and the rules that every module must obey.

Rules:

* inputs and outputs are of exactly the declared classes, and no required output is missing;
* a message among them is unchanged after encoding and decoding;
* an update changes neither its inputs nor outputs of an earlier update, because other modules have the same objects.

Values are compared by their pickles; a value that cannot be pickled is not compared.
"""

from __future__ import annotations

import io
import pickle
import typing
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from backbone.bus.inbox import reader_of
from backbone.errors import Refusal
from backbone.naming import did_you_mean
from backbone.wire import MAX_LARGE_MESSAGE_BYTES, WIRE_VERSION, Envelope, Message, write
from mission_control.modules.exchangeable import is_of
from mission_control.modules.module import Module, default_name
from mission_control.modules.orders import is_message
from mission_control.modules.ports import Port, Ports, kinds_of_ports, ports_of, type_name
from mission_control.modules.run import member_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MOST_HELD = 8  # chosen: inputs and outputs of four updates; a module rarely writes into more buffers in turn
AnyModule = TypeVar("AnyModule", bound=Module)
Pickles = Mapping[str, bytes | None]


class ModuleRuleBroken(Refusal):
    """A module, or the test that feeds it, broke a rule of modules."""

    code = "module.rule"


class ModuleUnderTest:
    """A module that a test feeds by hand; each update checks the rules.

    Attributes:
        module: The module itself.
        shown: Debug view → newest picture or value; pictures are always made.
    """

    def __init__(self, module: Module) -> None:
        self.module, self.shown = watched(module), dict[str, object]()
        module.debug = ShownViews(self.shown)
        self._history: list[tuple[dict[str, object], Pickles]] = []

    def update(self, **inputs: object) -> Any:
        """Return the module's outputs for these inputs; the names are those of the fields of ``Inputs``.

        Raises:
            ModuleRuleBroken: The inputs differ from the declared ones, or the module broke a rule.
        """
        _check_names(self.module, inputs)
        outputs = self.module.update(self.module.Inputs(**inputs))
        self._history.append((inputs, _pickles(outputs)))
        return outputs

    def check_reset(self) -> None:
        """Reset the module, feed all inputs so far again, and check that the outputs are the same.

        Raises:
            ModuleRuleBroken: The outputs differ, so ``reset`` does not set all attributes.
        """
        self.module.reset()
        for number, (inputs, before) in enumerate(self._history, 1):
            if _pickles(self.module.update(self.module.Inputs(**inputs))) != before:
                name = default_name(type(self.module))
                raise ModuleRuleBroken(
                    f"update {number} of {name} says something else after a reset",
                    remedy="Set in reset every attribute that update changes; use no clock and no random numbers.",
                )


MakeModule = Callable[[Module], ModuleUnderTest]


class ShownViews:
    """Debug views that are always watched; see ``mission_control.modules.module.Debug``."""

    def __init__(self, into: dict[str, object]) -> None:
        self._into = into

    def picture(self, view: str, make: Callable[[], NDArray[np.generic]]) -> None:
        """Make the picture and keep it."""
        self._into[view] = make()

    def value(self, view: str, value: float | bool | str) -> None:
        """Keep the value."""
        self._into[view] = value


def watched(module: AnyModule) -> AnyModule:
    """Return the module; from now on each of its updates raises ``ModuleRuleBroken`` if it breaks a rule.

    Raises:
        WrongDeclaration: A port cannot be read from its declaration, or no unit could call ``update``.
        WrongModule: It is no module, for example a class in place of its instance; the class stays as it is.
    """
    name, update = member_of(module).name, module.update
    handed_over = list[tuple[object, Pickles]]()

    def checked(inputs: Ports) -> Ports:
        _check_values(name, "input", inputs)
        handed_over.append((inputs, _pickles(inputs)))
        outputs: object = update(inputs)
        for struct, before in handed_over:
            _check_unchanged(name, struct, before)
        if type(outputs) is not module.Outputs:
            kind = type_name(type(outputs))
            remedy = f"Return self.Outputs(…), declared as {type_name(module.Outputs)}."
            raise ModuleRuleBroken(f"{name} returns {kind}", remedy=remedy)
        _check_values(name, "output", outputs)
        handed_over.append((outputs, _pickles(outputs)))
        del handed_over[:-MOST_HELD]
        return outputs

    module.update = checked  # type: ignore[method-assign]  # this one module only
    return module


def _check_names(module: Module, inputs: Mapping[str, object]) -> None:
    ports, name = ports_of(module.Inputs), default_name(type(module))
    known = [port.name for port in ports]
    declared = f"It declares {', '.join(known) or 'no input'}."
    for given in inputs:
        if given not in known:
            detail = f"{name} has no input {given!r}{did_you_mean(given, known)}"
            raise ModuleRuleBroken(detail, remedy=declared)
    for port in ports:
        if port.is_required and port.name not in inputs:
            raise ModuleRuleBroken(f"{name} waits for its input {port.name}", remedy=declared)


def _check_values(module: str, what: str, struct: Ports) -> None:
    for port in ports_of(type(struct)):
        value, kind = getattr(struct, port.name), kinds_of_ports(type(struct))[port.name]
        if value is not None or port.is_required:
            check_value(f"{what} {port.name} of {module}", port, kind, value)


def check_value(what: str, port: Port, kind: object, value: object) -> None:
    """Check the value of a port.

    Args:
        what: The port, for people.
        kind: Class of its values, as declared.

    Raises:
        ModuleRuleBroken: The value is not of the class, or could not cross the bus.
    """
    top = typing.get_origin(kind) or kind
    if not is_of(value, top):
        remedy = "Messages are of exactly the declared class; an output that may be left out has the default None."
        raise ModuleRuleBroken(f"{what} is {type_name(type(value))}, declared is {port.type}", remedy=remedy)
    if is_message(top) and isinstance(value, Message):
        most = MAX_LARGE_MESSAGE_BYTES
        try:
            written = write(Envelope(WIRE_VERSION, "kit/kit", 0, 0.0, "", value), most)
            same = write(reader_of(type(value)).read(written, most), most) == written
        except (Refusal, TypeError, BufferError) as error:  # a field of another class; pixels with gaps between them
            cause, remedy = (error.detail, error.remedy) if isinstance(error, Refusal) else (str(error), "")
            raise ModuleRuleBroken(f"{what} cannot cross the bus: {cause}", remedy=remedy) from None
        if not same:
            raise ModuleRuleBroken(f"{what} is not the same after the bus", remedy="Use fields of the declared types.")


def _check_unchanged(module: str, struct: object, before: Pickles) -> None:
    for name, after in _pickles(struct).items():
        if after != before[name]:
            raise ModuleRuleBroken(
                f"{module} changed {name} of {type_name(type(struct))} after it was handed over",
                remedy="Make a new object, because others have the same one.",
            )


def _pickles(struct: object) -> Pickles:
    return {name: _pickle(getattr(struct, name)) for name in getattr(struct, "__struct_fields__", ())}


def _pickle(value: object) -> bytes | None:
    written = io.BytesIO()
    pickler = pickle.Pickler(written)
    pickler.fast = True  # so that equal values give equal bytes, whichever of their parts are the same object
    pickler.dispatch_table = {memoryview: lambda view: (memoryview, (view.tobytes(),))}
    try:
        pickler.dump(value)
    except (pickle.PicklingError, TypeError, AttributeError, ValueError):  # raised for values that it cannot pickle
        return None
    return written.getvalue()
