"""The reference page of the module kit, made of its docstrings."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections.abc import Iterator
from pathlib import Path

from mission_control.laboratory.module_kit import plugin
from mission_control.laboratory.module_kit.graph_under_test import GraphUnderTest
from mission_control.laboratory.module_kit.module_under_test import ModuleUnderTest
from mission_control.laboratory.module_kit.real_mission import RealMission
from mission_control.laboratory.simulation.whole_mission import RunningMission

GIVES: dict[str, type] = {
    "module_under_test": ModuleUnderTest,
    "module_graph": GraphUnderTest,
    "virtual_mission": RunningMission,
    "real_mission": RealMission,
}
_FIXTURES = "## Fixtures\n"


def kit_reference(page: str) -> str:
    """Return the page with a section for each fixture; the text before them stays."""
    head, _, _ = page.partition(_FIXTURES)
    body = ast.parse(Path(plugin.__file__).read_text("utf-8")).body
    fixtures = {one.name: ast.get_docstring(one) or "" for one in body if isinstance(one, ast.FunctionDef)}
    return head + _FIXTURES + "".join(f"\n{line}\n" for name, text in fixtures.items() for line in _section(name, text))


def _section(name: str, text: str) -> Iterator[str]:
    prose, _, example = text.partition("\nExample:\n")
    yield f"### `{name}`"
    yield _markdown(prose)
    yield "```python\n" + re.sub(r"^(>>>|\.\.\.) ?", "", textwrap.dedent(example), flags=re.MULTILINE).strip() + "\n```"
    yield f"What a test gets, `{GIVES[name].__name__}`:"
    yield "\n".join(["| | |", "|---|---|", *_members(GIVES[name])])


def _members(kind: type) -> Iterator[str]:
    attributes = (inspect.getdoc(kind) or "").partition("Attributes:\n")[2].partition("\n\n")[0]
    for attribute in re.sub(r"\n {8,}", " ", textwrap.dedent(attributes)).splitlines():
        name, _, meaning = attribute.strip().partition(": ")
        yield f"| `{name}` | {_markdown(meaning)} |"
    for name, member in vars(kind).items():
        if name.startswith("_"):
            continue
        if isinstance(member, property):
            yield f"| `{name}` | {_summary(member)} |"
        elif inspect.isfunction(member):
            inputs = list(inspect.signature(member).parameters.values())[1:]
            call = ", ".join(str(one.replace(annotation=one.empty)) for one in inputs)
            yield f"| `{name}({call})` | {_summary(member)} |"


def _summary(member: object) -> str:
    return _markdown((inspect.getdoc(member) or "").partition("\n\n")[0].replace("\n", " "))


def _markdown(text: str) -> str:
    return text.strip().replace("``", "`")
