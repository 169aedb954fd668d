"""The parts of mission files on the how-to pages are sound, each in a mission around it."""

from __future__ import annotations

import re
import textwrap
from pathlib import Path

import pytest
from mission_files import MISSION_XML, faults_in, read_text

from backbone.mission.reader import read_mission

DOCS = MISSION_XML.parent / "docs"
MISSION = MISSION_XML.read_text()
HOSTS = re.compile(r"<hosts>.*?</hosts>", re.DOTALL)
WORLD = re.compile(r"<world.*?</world>", re.DOTALL)
OTHER_SCOUTS = re.compile(r'<resource type="scout" name="scout2".*name="scout3".*?</resource>', re.DOTALL)
RADIO = re.compile('<resource type="command_radio".*/>')
BEHAVIORS = re.compile(r"<behaviors>.*?</behaviors>", re.DOTALL)
ONE_SCOUT = OTHER_SCOUTS.sub("", BEHAVIORS.sub("", MISSION))


def parts_of(page: str) -> list[str]:
    """Return the XML blocks of a page of ``docs/how-to``, also those inside a list."""
    text = (DOCS / "how-to" / page).read_text()
    return [textwrap.dedent(block) for block in re.findall(r"^ *```xml\n(.*?)^ *```", text, re.DOTALL | re.MULTILINE)]


def put(place: re.Pattern[str], part: str, text: str = MISSION) -> str:
    """Return the mission with this part in place of its own."""
    assert place.search(text)
    return place.sub(lambda _: part, text, count=1)


def test_the_room_of_the_page_can_be_built(tmp_path: Path) -> None:
    world, _plan, _room = parts_of("build-a-room.md")
    read_text(tmp_path, put(WORLD, world, ONE_SCOUT))


def test_a_floor_plan_and_a_room_in_mjcf_lie_beside_the_mission_file(tmp_path: Path) -> None:
    _world, plan, room = parts_of("build-a-room.md")
    (tmp_path / "plan.png").write_bytes((DOCS / "pictures" / "placements.png").read_bytes())
    (tmp_path / "corridor.mjcf").write_text((DOCS / "examples" / "corridor.mjcf").read_text())
    world = f'<world>{room}<robot name="scout1" x-m="1" y-m="1"/></world>'
    read_text(tmp_path, put(WORLD, world, put(re.compile('<resource type="localizer".*/>'), plan, ONE_SCOUT)))


def test_the_hosts_of_the_page_are_a_mission_of_several_hosts(tmp_path: Path) -> None:
    [hosts] = parts_of("run-on-several-hosts.md")
    assert [host.name for host in read_text(tmp_path, put(HOSTS, hosts)).hosts] == ["base", "far"]


def test_the_components_of_the_page_share_a_process(tmp_path: Path) -> None:
    [parts] = parts_of("share-a-process.md")
    apart = MISSION.replace(' process="hardware"', "")
    for element in parts.splitlines():
        written = element.removesuffix(" …/>")
        plain = written.replace(' process="hardware"', "")
        assert plain in apart
        apart = apart.replace(plain, written)
    resources = read_text(tmp_path, apart).resources
    assert [one.name for one in resources if one.process == "hardware"] == ["radio", "scout1"]


def test_the_behavior_of_the_page_is_a_type_and_a_node(tmp_path: Path) -> None:
    [parts] = parts_of("write-a-behavior.md")
    kind, node = parts.split("…\n")
    own = MISSION.replace("</behaviors>", f"{node}</behaviors>").replace(
        "<resources>", f"<types>{kind}</types><resources>"
    )
    assert [node.name for node in read_text(tmp_path, own).behaviors][-1] == "turner"


METHODS = """
    async def open(self) -> None: ...
    async def close(self) -> None: ...
    async def transmit(self, *packet, **more): ...
"""


def test_the_serial_radio_of_the_page_has_the_options_of_its_resource(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = (DOCS / "how-to" / "write-a-driver.md").read_text()
    [driver] = re.findall(r"^ *```python\n(.*?)^ *```", text, re.DOTALL | re.MULTILINE)
    imports = "import msgspec\nfrom resource_pool.drivers.interface import DriverSite\n"
    (tmp_path / "my_robots").mkdir()
    (tmp_path / "my_robots" / "__init__.py").touch()
    (tmp_path / "my_robots" / "radio.py").write_text(imports + textwrap.dedent(driver) + METHODS)
    monkeypatch.syspath_prepend(tmp_path)
    radio, _lamp, _arc = parts_of("write-a-driver.md")
    read_text(tmp_path, put(RADIO, radio))
    missing, unknown = faults_in(tmp_path, put(RADIO, radio.replace('name="port"', 'name="prot"')))
    assert "lacks parameter port" in missing.message
    assert "no parameter 'prot'" in unknown.message


def test_the_lamp_of_the_page_and_its_arc_are_types_and_a_resource(tmp_path: Path) -> None:
    _radio, lamp, arc = parts_of("write-a-driver.md")
    kind, resource = lamp.split("…\n")
    read_text(tmp_path, put(re.compile("<resources>"), f"<types>{kind}{arc}</types><resources>{resource}"))


@pytest.mark.parametrize(
    ("page", "mission"),
    [
        ("first-mission", "mission.xml"),
        ("the-intruder-nobody-saw", "docs/examples/intruder.xml"),
        ("compose-a-tree", "docs/examples/night.xml"),
    ],
)
def test_a_tutorial_counts_the_resources_of_its_mission(page: str, mission: str) -> None:
    """The run of a tutorial lets numbers differ; this one cannot."""
    told = re.search(r"is fine: (\d+) resources", (DOCS / "tutorial" / f"{page}.md").read_text())
    assert told is not None
    assert len(read_mission(DOCS.parent / mission).resources) == int(told[1])
