"""Orders of components whose class was exchanged at run time. Pure.

Rule: a creator restarts an exchanged component with its new class. A component that is placed anew has the class and
parameters of the mission file, because other hosts may not have the new class, and creators start no other classes. An
exchanged module or driver is a parameter of a class that stays, so it is kept then, too.
"""

from __future__ import annotations

import msgspec

from backbone.creator.messages import DeclaredClass, Spawn
from backbone.placer.messages import ReviseStart


def revised(order: Spawn, by: ReviseStart) -> Spawn:
    """Return the order of the component's next start; it keeps what the mission file declares."""
    declared, class_path = order.declared, by.class_path or order.class_path
    if declared is None and class_path != order.class_path:
        declared = DeclaredClass(order.class_path, order.parameters)
    elif declared is not None and by.others_stay:  # a change of the tree, which holds for both classes
        declared = DeclaredClass(declared.class_path, declared.parameters | by.parameters)
    parameters = (order.parameters if by.others_stay else {}) | by.parameters
    return msgspec.structs.replace(order, class_path=class_path, parameters=parameters, declared=declared)


def as_declared(order: Spawn) -> Spawn:
    """Return the order with the class and the parameters of the mission file."""
    if order.declared is None:
        return order
    class_path, parameters = order.declared.class_path, order.declared.parameters
    return msgspec.structs.replace(order, class_path=class_path, parameters=parameters, declared=None)
