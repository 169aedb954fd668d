"""Parameters are those of the classes the mission names; the classes are asked in another process."""

from __future__ import annotations

import math
import re
import sys
import time
from enum import Enum
from pathlib import Path
from typing import Annotated

import msgspec
import pytest

from backbone.component.abilities import UNLIMITED
from backbone.mission import class_asking
from backbone.mission.behavior_orders import TREE_PARAMETERS
from backbone.mission.class_asking import ask_classes
from backbone.mission.class_facts import ClassFacts, ParameterFacts, parameters_of, shipped_classes
from backbone.mission.reader import Fault, MissionInvalid, read_mission, read_mission_bytes
from backbone.mission.shipped_types import shipped_types
from backbone.mission.tables import parameter_value

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
SMALL = (HERE / "small.xml").read_text()
PROTOCOL = "resource_pool.drivers.simulated:SimulatedScoutProtocol"
OWN_TYPE = '    <type name="own" class="{path}" subsystem="mission_control"/>\n  </types>'
GOOD = """
import msgspec
from mission_control.behavior import Behavior, BehaviorParameters

class Parameters(BehaviorParameters, frozen=True, kw_only=True):
    '''Own.

    Attributes:
        depth_m: How deep.
    '''

    depth_m: float = 1.0

class Own(Behavior):
    parameters_type = Parameters
"""


def with_own_type(path: str, **parameters: str) -> str:
    given = "".join(f'<parameter name="{name}" value="{value}"/>' for name, value in parameters.items())
    behavior = f'    <behavior type="own" name="mine" priority="1">{given}</behavior>\n  </behaviors>'
    return SMALL.replace("  </types>", OWN_TYPE.format(path=path)).replace("  </behaviors>", behavior)


def faults_in(folder: Path, text: str) -> list[Fault]:
    file = folder / "m.xml"
    file.write_text(text)
    try:
        read_mission(file)
    except MissionInvalid as invalid:
        return list(invalid.faults)
    return []


@pytest.fixture
def modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder whose modules can be imported."""
    monkeypatch.syspath_prepend(str(tmp_path))
    return tmp_path


def test_a_class_of_ones_own_is_asked_for_its_parameters(modules: Path) -> None:
    (modules / "own_good.py").write_text(GOOD)
    text = with_own_type("own_good:Own", dept_m="2")
    [fault] = faults_in(modules, text)
    assert text.splitlines()[fault.line - 1][fault.column - 1 :].startswith('name="dept_m"')
    assert fault.message == "own has no parameter 'dept_m' (did you mean 'depth_m'?)"
    assert fault.remedy == "There is: depth_m"
    assert not faults_in(modules, with_own_type("own_good:Own", depth_m="2"))
    assert "own_good" not in sys.modules


@pytest.mark.parametrize(
    ("code", "reason"),
    [
        (
            "\nimport no_such_module\nclass Own: ...",
            "ModuleNotFoundError: No module named 'no_such_module' ({file}, line 2)",
        ),
        ("class Own:\n  1 / 0", "its module cannot be imported: ZeroDivisionError: division by zero ({file}, line 2)"),
        ("import json\njson.loads('no')\nclass Own: ...", "Expecting value: line 1 column 1 (char 0) ({file}, line 2)"),
        ("class Own:\n  def act(self:\n    ...", " ({file}, line 2)"),
        ("print('Own')\nimport os\nos._exit(3)", "the process that imports its module ends without an answer"),
        ("import sys\nsys.exit('Own')", "its module cannot be imported: SystemExit: Own ({file}, line 2)"),
        (GOOD.replace("float = 1.0", "type | set[complex] = int"), "cannot be listed: parameter depth_m: TypeError"),
        (GOOD.replace("Own(Behavior):", "Own(Behavior):\n    driver_options = 5"), "cannot be listed: TypeError"),
    ],
    ids=["import", "error", "library", "syntax", "exit", "sys.exit", "no schema", "hook"],
)
def test_a_class_that_cannot_be_imported_is_a_fault_at_its_type(
    modules: Path, code: str, reason: str, request: pytest.FixtureRequest
) -> None:
    name = f"own_{request.node.callspec.id}".replace(".", "_").replace(" ", "_")
    (modules / f"{name}.py").write_text(code)
    text = with_own_type(f"{name}:Own", any="thing").replace('name="view_s"', 'name="veiw_s"')
    at_type, at_parameter = faults_in(modules, text)
    assert text.splitlines()[at_type.line - 1][at_type.column - 1 :].startswith(f'class="{name}:Own"')
    assert reason.format(file=modules / f"{name}.py") in at_type.message
    assert at_type.remedy
    assert "veiw_s" in at_parameter.message


@pytest.mark.parametrize(
    ("declared", "legal", "illegal"),
    [("Annotated[int, msgspec.Meta(multiple_of=5)] = 5", "10", "7"), ("date | None = None", "2026-11-27", "today")],
)
def test_a_value_that_only_the_class_can_judge_is_judged_by_it(
    modules: Path, declared: str, legal: str, illegal: str
) -> None:
    imports = "from datetime import date\nfrom typing import Annotated\n"
    module = f"own_{len(declared)}"
    (modules / f"{module}.py").write_text(imports + GOOD.replace("float = 1.0", declared))
    assert not faults_in(modules, with_own_type(f"{module}:Own", depth_m=legal))
    [fault] = faults_in(modules, with_own_type(f"{module}:Own", depth_m=illegal))
    assert "own mine refuses its parameters" in fault.message


def test_a_list_is_refused_with_the_reason_that_no_value_will_do(modules: Path) -> None:
    (modules / "own_list.py").write_text(GOOD.replace("float = 1.0", "list[float] = []"))
    [fault] = faults_in(modules, with_own_type("own_list:Own", depth_m="1,2"))
    assert "a list, which no mission file gives" in fault.remedy


def test_a_class_that_ends_its_process_when_it_judges_holds_nothing_up(modules: Path) -> None:
    rule = "    def __post_init__(self):\n        import os\n        os._exit(1)\n\nclass Own"
    (modules / "own_judge.py").write_text(GOOD.replace("\nclass Own", rule))
    assert not faults_in(modules, with_own_type("own_judge:Own", depth_m="2"))


def test_a_rule_of_a_class_with_a_bug_is_a_fault_and_hides_no_other(modules: Path) -> None:
    rule = "    def __post_init__(self):\n        raise {error}(f'{{self.depth_m}} is too deep')\n\nclass Own"
    for error in ("KeyError", "ValueError"):
        (modules / f"own_{error.lower()}.py").write_text(GOOD.replace("\nclass Own", rule.format(error=error)))
    text = with_own_type("own_keyerror:Own", depth_m="2.5")
    other = OWN_TYPE.format(path="own_valueerror:Own").replace('"own"', '"other"')
    mine = '    <behavior type="other" name="yours" priority="1"><parameter name="depth_m" value="3.5"/></behavior>'
    text = text.replace("  </types>", other, 1).replace("  </behaviors>", f"{mine}\n  </behaviors>")
    bug, refusal = faults_in(modules, text)
    line = f"{modules / 'own_keyerror.py'}, line 14"
    assert bug.message == f"own mine refuses its parameters: KeyError: '2.5 is too deep' ({line})"
    assert refusal.message == "other yours refuses its parameters: 3.5 is too deep"


def test_rules_of_a_class_are_asked_once_for_the_same_parameters(modules: Path) -> None:
    rule = "    def __post_init__(self):\n        raise ValueError(f'{self.depth_m} is too deep')\n\nclass Own"
    (modules / "own_rule.py").write_text(GOOD.replace("\nclass Own", rule))
    text = with_own_type("own_rule:Own", depth_m="2.5")
    [fault] = faults_in(modules, text)
    assert fault.message == "own mine refuses its parameters: 2.5 is too deep"
    (modules / "own_rule.py").write_text("raise SystemError\nclass Own: ...")
    assert faults_in(modules, text) == [fault]


ABLE = """
import math
from typing import Literal
import msgspec
from backbone.component.abilities import Abilities, field_forms
from backbone.component.component import Component

class Reports(msgspec.Struct):
    depth_m: float = math.nan
    way_m: float = -math.inf
    echoes: int = 2**70
    mode: Literal[WORDS] = "w0"

class Own(Component):
    @classmethod
    def abilities(cls):
        return Abilities(reports=field_forms(Reports, limits={"way_m": (-math.inf, math.inf), "echoes": (0, 2**70)}))
"""


def able(words: int) -> str:
    return ABLE.replace("WORDS", ", ".join(f'"w{number}"' for number in range(words)))


def test_limits_and_defaults_without_an_end_are_those_of_all_numbers(modules: Path) -> None:
    """JSON and messages have no infinity; a lab's RC writes one where its hardware has no limit."""
    (modules / "own_endless.py").write_text(able(2))
    facts = ask_classes(["own_endless:Own"])["own_endless:Own"]
    assert facts.failure == ""
    depth, way, echoes, mode = facts.abilities.reports
    assert (way.least, way.most) == (-UNLIMITED, UNLIMITED)
    assert (echoes.least, echoes.most) == (0.0, UNLIMITED)
    assert [one.default for one in (depth, way, echoes, mode)] == [0.0, 0.0, 0.0, "w0"]


def test_a_class_that_declares_too_much_is_a_fault_at_its_type(modules: Path) -> None:
    (modules / "own_wordy.py").write_text(able(300))
    [fault] = faults_in(modules, with_own_type("own_wordy:Own"))
    assert "own_wordy:Own: what it declares cannot be read: Expected `array` of length <= 256" in fault.message


def limit_for_this_machine(modules: Path) -> int:
    """Return five times the seconds in which a class answers here, beside the machine's other work."""
    (modules / "own_before.py").write_text(GOOD)
    began_s = time.monotonic()
    assert not ask_classes(["own_before:Own"])["own_before:Own"].failure
    return max(3, math.ceil(5 * (time.monotonic() - began_s)))


@pytest.mark.thorough
def test_a_module_that_hangs_is_a_fault_and_holds_up_nothing_else(
    modules: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    within_s = limit_for_this_machine(modules)
    monkeypatch.setattr(class_asking, "WITHIN_S", within_s)
    (modules / "own_hanging.py").write_text(f"import time\ntime.sleep({10 * within_s})\nclass Own: ...")
    (modules / "own_after.py").write_text(GOOD)
    found = ask_classes(["own_hanging:Own", "own_after:Own"])
    place = f"{modules / 'own_hanging.py'}, line 2"
    assert f"not imported within {within_s} s; it is at {place}" in found["own_hanging:Own"].failure
    assert [one.name for one in found["own_after:Own"].parameters] == ["depth_m"]


@pytest.mark.thorough
def test_the_line_at_which_a_module_hangs_is_known_also_if_the_process_that_asks_it_starts_slowly(
    modules: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    within_s = limit_for_this_machine(modules)
    monkeypatch.setattr(class_asking, "WITHIN_S", within_s)
    (modules / "sitecustomize.py").write_text(f"import time\ntime.sleep({0.4 * within_s})")  # at the process's start
    (modules / "own_late.py").write_text(f"import time\ntime.sleep({10 * within_s})\nclass Own: ...")
    found = ask_classes(["own_late:Own"])["own_late:Own"].failure
    assert found.endswith(f"not imported within {within_s} s; it is at {modules / 'own_late.py'}, line 2")


def test_a_thread_that_a_module_starts_holds_up_no_check(modules: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(class_asking, "WITHIN_S", 20.0)
    thread = "import threading, time\nthreading.Thread(target=time.sleep, args=(60.0,)).start()\n"
    (modules / "own_threaded.py").write_text(thread + GOOD)
    began_s = time.monotonic()
    assert not ask_classes(["own_threaded:Own"])["own_threaded:Own"].failure
    assert time.monotonic() - began_s < 20.0


def test_a_class_on_another_machine_may_be_one_that_cannot_be_imported_here(modules: Path) -> None:
    (modules / "own_elsewhere.py").write_text("import no_such_module\nclass Own: ...")
    text = with_own_type("own_elsewhere:Own", any="thing")
    text = text.replace('address="127.0.0.1"', 'address="192.0.2.1"')
    text = text.replace("  </hosts>", '    <host name="attic" address="192.0.2.7"/>\n  </hosts>')
    text = text.replace("  </core>", '    <service type="creator" host="attic"/>\n  </core>')
    assert not faults_in(modules, text)


def test_bytes_are_read_without_running_a_module_if_the_caller_says_which_classes_are_known(modules: Path) -> None:
    (modules / "own_unasked.py").write_text("from pathlib import Path\nPath(__file__).with_name('ran').touch()")
    text = with_own_type("own_unasked:Own", any="thing").replace('name="view_s"', 'name="veiw_s"')
    with pytest.raises(MissionInvalid) as caught:
        read_mission_bytes(text.encode(), "m.xml", {})
    assert [fault.message for fault in caught.value.faults if "no class" not in fault.message] == [
        "watch has no parameter 'veiw_s' (did you mean 'view_s'?)"
    ]
    some = ParameterFacts("some", {"type": "integer"})
    known = {"own_unasked:Own": ClassFacts(parameters=(some,), given=TREE_PARAMETERS)}
    with pytest.raises(MissionInvalid, match="own mine lacks parameter some"):
        read_mission_bytes(text.encode(), "m.xml", known)
    assert not (modules / "ran").exists()


def test_a_parameter_under_a_driver_that_nobody_knows_here_is_not_judged(tmp_path: Path) -> None:
    grabber = '<resource type="framegrabber" name="grabber">'
    given = '<parameter name="device" value="/dev/video0"/><parameter name="frame_rate_hz" value="fast"/>'
    text = SMALL.replace(grabber, f'{grabber[:-1]} driver="my_lab.v4l2:Grabber">{given}')
    text = text.replace('address="127.0.0.1"', 'address="192.0.2.1"')
    [fault] = faults_in(tmp_path, text)
    assert fault.message == "frame_rate_hz='fast' is illegal"


@pytest.mark.parametrize("text", ["15", "-0.5", "3.0", "1e-3", "true", "gl", "auto", "", "NaN", "1e400", "-1", "31"])
def test_a_value_passes_exactly_if_the_class_would_start_with_it(text: str) -> None:
    for path, facts in shipped_classes().items():
        module, _, name = path.partition(":")
        if not path.startswith("resource_pool.rcs"):
            continue
        struct = getattr(__import__(module, fromlist=[name]), name).parameters_type
        types = {field.encode_name: field.type for field in msgspec.structs.fields(struct)}
        for one in facts.parameters:
            assert one.accepts(parameter_value(text)) == fits(parameter_value(text), types[one.name]), (path, one.name)


def fits(value: object, kind: object) -> bool:
    try:
        msgspec.convert(value, kind)
    except msgspec.ValidationError:
        return False
    return True


def test_facts_of_a_type_name_what_it_takes_for_people() -> None:
    class Kinds(msgspec.Struct):
        a: int | None
        b: list[str] = []
        c: bool = True

    assert [one.legal_values for one in parameters_of(Kinds)] == [
        "integer or null",
        "a list, which no mission file gives",
        "true or false",
    ]
    assert [one.summary for one in parameters_of(Kinds)][2] == "boolean, default true"
    assert [one.accepts(None) for one in parameters_of(Kinds)] == [True, False, False]


class Color(Enum):
    RED = "red"
    BLUE = "blue"


class Box(msgspec.Struct, frozen=True):
    width_m: float = 1.0


def test_a_word_of_an_enumeration_and_a_struct_may_be_defaults() -> None:
    class Kinds(msgspec.Struct):
        asked: Color
        color: Color = Color.RED
        box: Box = Box()

    assert [one.is_required for one in parameters_of(Kinds)] == [True, False, False]
    assert parameters_of(Kinds)[1].summary == 'one of blue, red, default "red"'


def test_the_reference_of_behaviors_has_the_parameters_of_their_classes_with_their_defaults() -> None:
    sections = (ROOT / "docs" / "reference" / "behaviors.md").read_text().split("\n## ")[1:]
    classes = {kind.text("name"): kind.text("class") for kind in shipped_types()}
    for section in sections:
        heading, _, text = section.partition("\n")
        kinds = re.findall(r"`(\w+)`", heading)
        if not kinds:
            continue  # of several behaviors, or of none
        known = {one.name: one for kind in kinds for one in shipped_classes()[classes[kind]].parameters}
        rows = re.findall(r"^\| (`[^|]*`) \|([^|]*)\|", text, re.MULTILINE)
        named = [name for names, _defaults in rows for name in re.findall(r"`(\w+)`", names)]
        assert set(named) == set(known), kinds
        for names, defaults in rows:
            written = [default.strip("` ") for default in defaults.split(",") if default.strip()]
            for name, default in zip(re.findall(r"`(\w+)`", names), written, strict=False):
                one = known[name]
                given = one.schema.get("default", "required")
                assert default == (given if isinstance(given, str) else f"{given:g}"), name


def test_the_only_robot_of_a_mission_needs_its_network_id_too(tmp_path: Path) -> None:
    smallest = (ROOT / "docs" / "examples" / "smallest.xml").read_text()
    without = re.sub(r" *<parameter .*\n", "", smallest).replace(
        'name="scout1">', f'name="scout1" driver="{PROTOCOL}">'
    )
    faults = faults_in(tmp_path, re.sub(r" *<robot .*\n", "", without))
    assert [fault.message for fault in faults] == ["scout scout1 lacks parameter network_id"]


def test_a_text_that_its_pattern_or_length_refuses_gets_them_in_the_remedy() -> None:
    class Kinds(msgspec.Struct):
        code: Annotated[str, msgspec.Meta(pattern="^[A-Z]+$", min_length=1, max_length=4)] = "A"

    [code] = parameters_of(Kinds)
    assert code.legal_values == "a text, at least 1 character, at most 4 characters, of the pattern ^[A-Z]+$"


def test_a_remedy_lists_no_nameless_elements(tmp_path: Path) -> None:
    text = SMALL.replace('<resource type="command_radio" name="radio"', '<resource type="command_radio"')
    remedies = [fault.remedy for fault in faults_in(tmp_path, text) if "no command_radio is named" in fault.message]
    assert set(remedies) == {"Declare a command_radio of this name"}
