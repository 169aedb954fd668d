"""The model of a mission has the fields and defaults that the mission file declares."""

from __future__ import annotations

import msgspec
import pytest
from pydantic_core import PydanticUndefined

from backbone.dependency_database.messages import Resource
from backbone.mission.behavior_nodes import ArcNeed, BehaviorNode
from backbone.mission.declaration.elements import ArcAttributes, BehaviorAttributes, HostElement, ResourceElement
from backbone.mission.declaration.parts import Declared
from backbone.mission.model import Host


@pytest.mark.parametrize(
    ("declared", "described"),
    [
        (ArcAttributes, ArcNeed),
        (BehaviorAttributes, BehaviorNode),
        (HostElement, Host),
        (ResourceElement, Resource),
    ],
)
def test_each_declared_attribute_has_a_field_with_the_same_default(
    declared: type[Declared], described: type[msgspec.Struct]
) -> None:
    fields = {one.name: one for one in msgspec.structs.fields(described)}
    attributes = {name: one.default for name, one in declared.model_fields.items() if name in fields}
    if declared is not ResourceElement:  # the elements inside it become other fields
        assert attributes.keys() == declared.model_fields.keys()
    for name, default in attributes.items():
        assert fields[name].required == (default is PydanticUndefined), name
        if fields[name].default is not msgspec.NODEFAULT:
            assert fields[name].default == default, name
