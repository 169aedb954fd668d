"""The part of the reference page that is made from the declared elements.

What a person wrote into an element's section, and whatever stands before the elements, stays.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from backbone.mission.class_facts import ClassFacts, ParameterFacts, shipped_classes
from backbone.mission.declaration.vocabulary import MANY, AttributeRule, ElementRule, vocabulary
from backbone.mission.parameter_checks import SERVICE_PARAMETERS
from backbone.mission.shipped_types import shipped_types
from backbone.mission.tables import SIMULATED, SIMULATED_WORLD, WORLD

_ELEMENTS = "## Elements\n"
_ATTRIBUTES = "| attribute | default | meaning |"
_RULES = "| parameter of the `rc_manager` | default | meaning |"
_PARAMETERS = "| type of resource | parameter | default | meaning |"
_OPTIONS = "| type of resource | driver | option | default | meaning |"


def reference_text(page: str) -> str:
    """Return the page with everything that is declared made anew.

    Args:
        page: The page as it is.
    """
    head, _, elements = page.partition(_ELEMENTS)
    sections = dict(part.partition("\n")[::2] for part in elements.split("\n### ")[1:])
    written = (_section(tag, rule, sections.get(f"`<{tag}>`", "")) for tag, rule in vocabulary().items())
    return f"{head}{_ELEMENTS}\n" + "\n".join(written)


def _section(tag: str, rule: ElementRule, before: str) -> str:
    paragraphs = [f"### `<{tag}>`", rule.documentation, *_places(tag), *_holdings(rule)]
    if rule.attributes:
        paragraphs.append(_table(_ATTRIBUTES, (_row(name, one) for name, one in rule.attributes.items())))
    return "\n\n".join([*paragraphs, *_notes(before)]) + "\n"


def _notes(before: str) -> Iterator[str]:
    """Yield what a person wrote into a section, with the tables of parameters in it made anew."""
    for paragraph in before.strip("\n").split("\n\n")[1:]:
        begin = paragraph.partition("\n")[0]
        if begin.startswith(("Stands in: ", "Holds: ", _ATTRIBUTES)):
            continue
        if begin == _RULES:
            yield _table(_RULES, (_parameter_row(one) for one in SERVICE_PARAMETERS["rc_manager"]))
        elif begin == _PARAMETERS:
            yield _table(_PARAMETERS, _resource_parameters())
        elif begin == _OPTIONS:
            yield _table(_OPTIONS, _driver_options())
        else:
            yield paragraph


def _resource_parameters() -> Iterator[str]:
    for kind, facts in _resource_types():
        for one in facts.parameters_with(SIMULATED) or ():
            if one.name != WORLD:
                yield f"| `{kind}` {_parameter_row(one)}"


def _driver_options() -> Iterator[str]:
    for kind, facts in _resource_types():
        for driver, options in (facts.options or {}).items():
            if driver != SIMULATED:
                yield from (f"| `{kind}` | `{driver}` {_parameter_row(one)}" for one in options)


def _resource_types() -> Iterator[tuple[str, ClassFacts]]:
    for kind in shipped_types():
        if kind.text("subsystem") == "resource_pool" and not kind.children and kind.text("name") != SIMULATED_WORLD:
            yield kind.text("name"), shipped_classes()[kind.text("class")]


def _parameter_row(one: ParameterFacts) -> str:
    default = one.schema.get("default")
    shown = f"{default:g}" if isinstance(default, float) else one.default.strip('"')
    return f"| `{one.name}` | {'required' if one.is_required else f'`{shown}`' if shown else '–'} | {one.meaning} |"


def _row(name: str, rule: AttributeRule) -> str:
    default = "required" if rule.required else "–" if rule.default is None else f"`{rule.default}`"
    return f"| `{name}` | {default} | {rule.documentation} |"


def _table(head: str, rows: Iterable[str]) -> str:
    return "\n".join([head, "|" + "---|" * (head.count("|") - 1), *rows])


def _places(tag: str) -> Iterator[str]:
    places = [f"`<{outer}>`" for outer, rule in vocabulary().items() if tag in rule.children]
    if places:
        yield f"Stands in: {', '.join(places)}."


def _holdings(rule: ElementRule) -> Iterator[str]:
    if rule.children:
        yield "Holds: " + ", ".join(f"{_count(*bounds)} `<{tag}>`" for tag, bounds in rule.children.items()) + "."


def _count(least: int, most: int) -> str:
    if most == MANY:
        return {0: "any number of", 1: "one or more", 2: "two or more"}.get(least, f"at least {least}")
    return "exactly one" if least else "at most one"
