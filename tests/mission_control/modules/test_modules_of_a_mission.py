"""Modules of a mission file: every fault at its place, and the same modules in other units are another file."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from pathlib import Path

import msgspec
import pytest

from backbone.bus.clock import run_virtual
from backbone.keys import Conversation
from backbone.mission import class_asking, class_probe
from backbone.mission.arranged import UnitsQuestion
from backbone.mission.class_facts import ClassFacts
from backbone.mission.model import MissionDescription
from backbone.mission.reader import MissionInvalid, read_mission, read_mission_bytes
from mission_control.laboratory.simulation.whole_mission import mission_in_one_process

pytestmark = [pytest.mark.processes]

TOP = Path(__file__).parents[3]
GIVEN = '<given key="number" class="sample_modules:Number" address="ui_console/tester" conversation="events"/>'


@pytest.fixture
def _arranged_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ask the modules' classes in this process: no interpreter starts for it, as it does for other tests."""

    def printed(what: str, about: Sequence[str], _late: str) -> tuple[list[bytes], str]:
        assert what == "arrange"
        questions = [msgspec.json.decode(one, type=UnitsQuestion) for one in about]
        return [msgspec.json.encode(class_probe.arranged(one)) for one in questions], ""

    monkeypatch.setattr(class_asking, "_printed", printed)


def mission(*units: str, given: str = GIVEN, hosts: str = "") -> str:
    inside = "\n".join(units)
    return f'<mission name="m" priority="1">\n{hosts}<modules>\n{given}\n{inside}\n</modules>\n</mission>\n'


def unit(name: str, *modules: str, attributes: str = "") -> str:
    return f'<unit name="{name}"{attributes}>\n' + "\n".join(modules) + "\n</unit>"


def module(name: str, kind: str, inside: str = "") -> str:
    return f'<module name="{name}" class="{kind}">{inside}</module>'


def read(tmp_path: Path, text: str) -> MissionDescription:
    file = tmp_path / "m.xml"
    file.write_text(text)
    return read_mission(file)


def faults(tmp_path: Path, text: str) -> list[str]:
    with pytest.raises(MissionInvalid) as invalid:
        read(tmp_path, text)
    assert all(fault.remedy for fault in invalid.value.faults)
    return [f"{fault.line}:{fault.column} {fault.message}" for fault in invalid.value.faults]


DOUBLER, SUMMING = module("doubler", "sample_modules:Doubler"), module("summing", "sample_modules:Summing")


def test_units_are_described_with_their_connections(tmp_path: Path) -> None:
    late = unit("late", SUMMING, attributes=' frequency-hz="5" on-input="none" process="p"')
    described = read(tmp_path, mission(unit("early", DOUBLER), late))
    early, then = described.units
    assert (early.type, early.name, then.process) == ("execution_unit", "early", "p")
    assert early.parameters["sources"] == {"number": {"address": "ui_console/tester", "conversation": "events"}}
    assert early.parameters["published"] == ["twice"]
    assert then.parameters["sources"] == {
        "twice": {"address": "mission_control/early/twice", "conversation": "outputs"}
    }
    assert (then.parameters["frequency_hz"], then.parameters["on_input"]) == (5.0, "none")
    assert then.parameters["published"] == ["sum"]
    assert not then.parameters["own_thread"]


def test_a_unit_with_a_thread_is_described_with_its_place(tmp_path: Path) -> None:
    place = ' own-thread="true" nice="-5" cpus="0 3"'
    [one] = read(tmp_path, mission(unit("one", DOUBLER, attributes=place))).units
    assert [one.parameters[name] for name in ("own_thread", "nice", "cpus")] == [True, -5, [0, 3]]


SIDE_BY_SIDE = module("doubler", "sample_modules:Doubler", '<output name="twice" key="by-two"/>')


def test_a_choice_is_described_as_a_module(tmp_path: Path) -> None:
    chosen = '<choose key="twice" from="by-two" or="number"/>'
    [one] = read(tmp_path, mission(unit("one", SIDE_BY_SIDE, SUMMING, chosen))).units
    assert one.parameters["published"] == ["by-two", "sum"]
    [*_, choice] = one.parameters["modules"]  # type: ignore[misc]
    assert (choice["name"], choice["parameters"]["sources"]) == ("choose-twice", ["by-two", "number"])


def test_a_quality_is_described_at_the_unit_that_publishes_the_key_and_at_those_that_take_it(tmp_path: Path) -> None:
    declared = '<quality key="twice" deadline-s="0.5" reliable="true" urgency="low" express="true" most-bytes="1000"/>'
    late = '<quality key="number" deadline-s="2"/>'
    early, then = read(tmp_path, mission(declared, late, unit("early", DOUBLER), unit("late", SUMMING))).units
    twice = {
        "reliable": True,
        "urgency": "low",
        "express": True,
        "most_bytes": 1000,
        "most_bytes_on_host": 1000,
        "deadline_s": 0.5,
    }
    assert then.parameters["qualities"] == {"twice": twice}
    number = {
        **twice,
        "reliable": False,
        "urgency": "normal",
        "express": False,
        "most_bytes": 8 * 1024**2,
        "most_bytes_on_host": 64 * 1024**2,
        "deadline_s": 2.0,
    }
    assert early.parameters["qualities"] == {"twice": twice, "number": number}


def test_who_must_not_import_anything_reads_the_file_without_connections() -> None:
    classes: dict[str, ClassFacts] = {}
    described = read_mission_bytes(mission(unit("early", DOUBLER)).encode(), "m.xml", classes)
    assert [(one.name, one.parameters) for one in described.units] == [("early", {})]


NO_KEY = '<input name="summand" key="nowhere"/>'
STEP = '<parameter name="step" value="fast"/>'
HOST = '<hosts><host name="base" address="127.0.0.1"/></hosts>'


@pytest.mark.usefixtures("_arranged_here")
@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            mission(unit("one", module("summing", "sample_modules:Summing", NO_KEY))),
            ["5:77 summing needs nowhere (sample_modules:Number), and no module produces it"],
        ),
        (
            mission(unit("one", DOUBLER, module("other", "sample_modules:Doubler"))),
            ["6:9 other produces twice, and so does doubler"],
        ),
        (
            mission(unit("one", DOUBLER), given=GIVEN.replace(":Number", ":Sum")),
            ["5:9 doubler takes sample_modules:Number as number, but from outside comes sample_modules:Sum"],
        ),
        (
            mission(
                unit("one", module("doubler", "sample_modules:Doubler", '<input name="number" key="twice"/>')),
            ),
            ["5:9 doubler waits for itself"],
        ),
        (
            mission(unit("one", DOUBLER, module("counter", "sample_modules:Counter", STEP)), unit("empty")),
            ["6:78 counter (sample_modules:Counter) refuses its parameters: Expected `float`, got `str` - at `$.step`"],
        ),
        (
            mission(unit("one", DOUBLER, module("counter", "sample_modules:Counter", STEP.replace("step", "stop")))),
            ["6:78 counter (sample_modules:Counter) refuses its parameters: Object contains unknown field `stop` (did"],
        ),
        (mission(unit("one", module("gone", "sample_modules:Gone"))), ["5:21 sample_modules:Gone: no class Gone"]),
        (mission(unit("one", module("no", "sample_modules:Number"))), ["5:19 sample_modules:Number is no module"]),
        (mission(unit("one", module("plain", "test_unit_component:Plain"))), ["4:7 unit one never runs"]),
        (
            mission(unit("one", SIDE_BY_SIDE, SUMMING, '<choose key="twice" from="by-tow"/>')),
            ["7:21 twice can be chosen from by-tow, and no module produces it (did you mean 'by-two'?)"],
        ),
        (
            mission(unit("one", SIDE_BY_SIDE, '<choose key="by-two" from="number"/>')),
            ["6:9 choose-by-two produces by-two, and so does doubler"],
        ),
        (
            mission('<quality key="twise" deadline-s="1"/>', unit("one", DOUBLER)),
            ["4:10 a quality is declared for twise, which no module produces (did you mean 'twice'?)"],
        ),
        (
            mission('<quality key="number" deadline-s="1" reliable="true"/>', unit("one", DOUBLER)),
            ["4:10 number comes from ui_console/tester, which sends it in its own quality"],
        ),
        (
            mission('<quality key="twice" deadline-s="-1" urgency="now" most-bytes="1e9"/>', unit("one", DOUBLER)),
            ["4:22 deadline-s='-1'", "4:38 urgency='now'", "4:52 most-bytes='1e9'"],
        ),
        (
            mission('<quality key="twice"/>', '<quality key="twice" deadline-s="1"/>', unit("one", DOUBLER)),
            ["5:10 a second quality of 'twice'; the first is in line 4"],
        ),
        (
            mission(unit("one", DOUBLER, attributes=' cpus="0"')),
            ["4:7 niceness and processors are those of a thread; let the unit have a thread of its own"],
        ),
        (
            mission(unit("one", DOUBLER, attributes=' own-thread="maybe" nice="20" cpus="0,1"')),
            ["4:18 own-thread='maybe'", "4:37 nice='20'", "4:47 cpus='0,1'"],
        ),
        (
            mission(unit("one", DOUBLER), given=GIVEN.replace("sample_modules:Number", "sample_modules:Counter")),
            ["3:21 sample_modules:Counter, the class of number, is no message"],
        ),
        (
            mission(unit("one", DOUBLER, DOUBLER, attributes=' host="nowhere" on-input="some"')),
            [
                "4:18 no host is named 'nowhere'",
                "4:33 on-input='some' in <unit> is illegal",
                "6:9 a second module 'doubler'; the first is in line 5",
            ],
        ),
        (
            mission(unit("world", DOUBLER), unit("world", SUMMING), unit("empty")),
            ["7:7 a second unit 'world'; the first is in line 4", "10:1 unit empty has no module"],
        ),
    ],
)
def test_every_fault_has_its_place(tmp_path: Path, text: str, told: list[str]) -> None:
    found = faults(tmp_path, text)
    for expected in told:
        assert any(line.startswith(expected) for line in found), found


HALF_WRITTEN = """
from mission_control.modules.module import Module

class NoPorts(Module):
    class Outputs:
        number: float

class Mistyped(Module):
    class Parameters(Module.Parameters, frozen=True):
        gain: "flaot" = 1.0

class Dark(Module):
    def reset(self):
        raise OSError("no camera")

class Leaving(Module):
    def reset(self):
        raise SystemExit(3)
"""


def test_a_module_that_cannot_be_imported_or_made_is_a_fault_at_its_class(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "broken_module.py").write_text("raise RuntimeError('being written')\nclass Broken: ...\n")
    (tmp_path / "dying_module.py").write_text("import os\nos._exit(3)\nclass Dying: ...\n")
    [broken] = faults(tmp_path, mission(unit("one", module("broken", "broken_module:Broken"))))
    place = f"({tmp_path / 'broken_module.py'}, line 1)"
    assert broken == f"5:23 broken_module:Broken: RuntimeError: being written {place}"
    (tmp_path / "written_module.py").write_text(HALF_WRITTEN)
    for name, told in (
        ("NoPorts", "5:20 written_module:NoPorts.Outputs declares no ports"),
        ("Mistyped", "5:20 one (written_module:Mistyped) cannot be made: NameError: name 'flaot' is not defined"),
        ("Dark", "5:20 one (written_module:Dark) cannot be made: OSError: no camera (" + str(tmp_path)),
        ("Leaving", "5:20 one (written_module:Leaving) cannot be made: SystemExit: 3"),
    ):
        [written] = faults(tmp_path, mission(unit("one", module("one", f"written_module:{name}"))))
        assert written.startswith(told)
    [dying] = faults(tmp_path, mission(unit("one", module("dying", "dying_module:Dying"))))
    assert "the modules' classes cannot be asked" in dying


def test_an_execution_unit_is_no_behavior(tmp_path: Path) -> None:
    text = '<mission name="m" priority="1">\n<behaviors>\n<behavior type="execution_unit" name="b" priority="1"/>\n'
    assert "3:11 type execution_unit is no behavior" in faults(tmp_path, f"{text}</behaviors></mission>")


def test_the_guide_shows_the_example() -> None:
    shown, *_ = re.findall(r"```xml\n(.*?)```", (TOP / "docs/how-to/write-a-module.md").read_text(), re.DOTALL)
    assert textwrap.indent(shown, "  ") in (TOP / "docs/examples/pair.xml").read_text()


def test_the_example_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(TOP / "docs/examples")
    [waves] = read_mission(TOP / "docs/examples/pair.xml").units
    assert waves.parameters["published"] == ["smooth"]


def test_a_mission_of_modules_runs_in_one_process_on_virtual_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(TOP / "docs/examples")
    import pair

    heights: list[pair.Height] = []

    async def main() -> dict[str, float]:
        async with mission_in_one_process(read_mission(TOP / "docs/examples/pair.xml")) as running:
            at = "mission_control/waves/smooth"
            running.bus.subscribe(at, Conversation.OUTPUTS, pair.Height, lambda one: heights.append(one.body))
            await running.clock.sleep_s(60.0)
            return await running.statistics("waves")

    told = run_virtual(main())
    assert told["rate_hz"] == pytest.approx(20.0)
    assert told["missed"] == 0
    assert len(heights) == pytest.approx(1200, abs=2)


def test_two_algorithms_stand_side_by_side_as_the_explanation_of_the_vision_shows(tmp_path: Path) -> None:
    [shown] = re.findall(r"```xml\n(.*?)```", (TOP / "docs/explanation/vision.md").read_text(), re.DOTALL)
    given = "".join(
        f'<given key="{key}" class="mission_control.messages:{kind}" address="ui_console/camera"/>'
        for key, kind in (("picture", "GreyPicture"), ("swapped_in", "SwappedIn"))
    )
    [vision] = read(tmp_path, mission(shown, given=given)).units
    assert vision.parameters["published"] == ["judged", "motion", "motion-by-difference"]


@pytest.mark.thorough
def test_a_thousand_modules_are_described(tmp_path: Path) -> None:
    renamed = '<input name="number" key="k{}"/><output name="twice" key="k{}"/>'
    rest = [module(f"m{n}", "sample_modules:Doubler", renamed.format(n - 1, n)) for n in range(1, 1000)]
    first = module("m0", "sample_modules:Doubler", '<output name="twice" key="k0"/>')
    [described] = read(tmp_path, mission(unit("one", first, *rest))).units
    assert len(described.parameters["modules"]) == 1000
