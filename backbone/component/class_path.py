"""Class paths: the class of a component at ``package.module:Class``."""

from __future__ import annotations

from backbone.component.class_faults import class_faults
from backbone.component.component import AnyComponent, Component
from backbone.errors import Refusal
from backbone.import_faults import import_fault, object_at
from backbone.shipped import is_shipped


class WrongClassPath(Refusal):
    """The class path names no component class."""

    code = "component.class"
    remedy = "Write the class as package.module:Class, importable on the component's host."


def load_class(class_path: str) -> type[AnyComponent]:
    """Return the component class at ``package.module:Class``.

    Raises:
        WrongClassPath: No component class has this path, or the class cannot work.
    """
    try:
        found = object_at(class_path)
    except (ImportError, AttributeError, ValueError) as error:
        told, remedy = import_fault(class_path, error)
        raise WrongClassPath(told, remedy=remedy, class_path=class_path) from error
    if not (isinstance(found, type) and issubclass(found, Component)):
        raise WrongClassPath(f"{class_path} is no Component", class_path=class_path)
    # Tests have judged the shipped classes, because a judgment takes a millisecond of each start.
    if not is_shipped(class_path) and (faults := "; ".join(class_faults(found))):
        raise WrongClassPath(f"{class_path}: {faults}", class_path=class_path, remedy="Mend the class.")
    return found
