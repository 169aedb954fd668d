"""What a mission file need not say, and that the shipped ones do not say it."""

import copy
import math
import re
from pathlib import Path

import msgspec
import pytest
from mission_files import HERE, MISSION_XML, SMALLEST, faults_in, read_text

from backbone.mission.behavior_orders import behavior_orders
from backbone.mission.reader import read_mission
from backbone.mission.shipped_types import shipped_text, shipped_types
from backbone.mission.tables import CORE_SERVICES
from scout_model.description import WorldDescription

MINIMAL = '<mission name="m" priority="1"/>'


def test_a_mission_of_one_element_has_a_host_the_core_services_and_the_shipped_types(tmp_path: Path) -> None:
    mission = read_text(tmp_path, MINIMAL)
    assert [(host.name, host.address) for host in mission.hosts] == [("base", "127.0.0.1")]
    assert [(service.type, service.host) for service in mission.core] == [(name, "base") for name in CORE_SERVICES]
    assert [kind.name for kind in mission.types] == [kind.text("name") for kind in shipped_types()]
    assert (mission.resources, mission.components, mission.behaviors) == ((), (), ())


def test_old_files_that_declare_everything_say_the_same(tmp_path: Path) -> None:
    services = "".join(f'<service type="{name}" host="base"/>' for name in CORE_SERVICES)
    types = shipped_text().decode().partition("<types>")[2].partition("</types>")[0]
    old = f'<mission name="m" priority="1"><core>{services}</core><types>{types}</types></mission>'
    assert read_text(tmp_path, old) == read_text(tmp_path, MINIMAL)
    declared, short = read_mission(HERE / "everything_declared.xml"), read_mission(MISSION_XML)
    assert msgspec.structs.replace(declared, source=short.source) == short


def test_a_type_takes_the_place_of_the_shipped_one_of_its_name(tmp_path: Path) -> None:
    own = '<type name="drive" class="backbone.component.component:Component" subsystem="resource_pool"/>'
    mission = read_text(tmp_path, f'<mission name="m" priority="1"><types>{own}</types></mission>')
    [drive] = [kind for kind in mission.types if kind.name == "drive"]
    assert (drive.class_path, drive.needs, drive.restart) == ("backbone.component.component:Component", {}, True)


def test_a_fault_of_a_type_that_replaces_shipped_hardware_stands_at_it(tmp_path: Path) -> None:
    own = '<type name="scout" class="backbone.component.component:Component" subsystem="mission_control"/>'
    faults = faults_in(tmp_path, f'\n<mission name="m" priority="1"><types>{own}</types></mission>')
    assert {(fault.line, fault.column) for fault in faults} == {(2, 45)}


def test_every_host_runs_a_creator_and_the_first_the_other_services(tmp_path: Path) -> None:
    hosts = '<host name="one" address="192.0.2.1"/><host name="two" address="192.0.2.2"/>'
    rules = '<service type="rc_manager"><parameter name="grid_s" value="4"/></service>'
    text = f'<mission name="m" priority="1"><core>{rules}</core><hosts>{hosts}</hosts></mission>'
    mission = read_text(tmp_path, text)
    assert [service.host for service in mission.core if service.type == "creator"] == ["one", "two"]
    assert {service.host for service in mission.core if service.type != "creator"} == {"one"}
    assert mission.core_parameters("rc_manager") == {"grid_s": 4}


def test_a_host_that_stands_twice_is_one_fault(tmp_path: Path) -> None:
    hosts = '<host name="one" address="127.0.0.1"/><host name="one" address="127.0.0.2"/>'
    [fault] = faults_in(tmp_path, f'<mission name="m" priority="1"><hosts>{hosts}</hosts></mission>')
    assert fault.message == "a second host 'one'; the first is in line 1"


def test_the_shipped_missions_say_only_what_is_their_own() -> None:
    assert len(MISSION_XML.read_text().splitlines()) <= 75
    assert len(SMALLEST.read_text().splitlines()) <= 15
    shipped = {kind.text("name") for kind in shipped_types()}
    for file in (MISSION_XML, *SMALLEST.parent.glob("*.xml")):
        text = file.read_text()
        assert "<core>" not in text, file
        assert shipped.isdisjoint(re.findall(r'<type name="(\w+)"', text)), file


def test_the_projects_mission_is_that_of_iros_2001_figure_2() -> None:
    """IROS 2001, figure 2: two behaviors and a console share three Scouts, one radio and one video frequency."""
    mission = read_mission(MISSION_XML)
    assert (mission.name, mission.priority) == ("iros2001", 10)
    by_kind: dict[str, list[str]] = {}
    for resource in mission.resources:
        by_kind.setdefault(resource.type, []).append(resource.name)
    assert by_kind == {
        "command_radio": ["radio"],
        "video_frequency": ["video1"],
        "framegrabber": ["grabber"],
        "scout": ["scout1", "scout2", "scout3"],
        "localizer": ["localizer"],
    }
    [surveillance] = mission.behaviors
    assert surveillance.priority == 5
    assert [(child.name, child.priority) for child in surveillance.children] == [
        ("watch-scout1", 1),
        ("watch-scout2", 1),
    ]
    arcs = [child.arc for child in surveillance.children]
    assert [arc and (arc.kind, arc.minimum_runtime_s, arc.wish) for arc in arcs] == [
        ("capture", 5.0, {"scout": "scout1"}),
        ("capture", 5.0, {"scout": "scout2"}),
    ]
    assert [order.name for order in behavior_orders(mission)] == ["surveillance"]


def test_the_projects_world_is_one_the_scout_model_understands() -> None:
    [world] = read_mission(MISSION_XML).components
    assert (world.type, world.name, world.host) == ("simulated_world", "world", "base")
    described = msgspec.convert(world.parameters["world"], WorldDescription)
    assert msgspec.json.decode(msgspec.json.encode(described)) == world.parameters["world"]
    assert [(scout.name, scout.network_id) for scout in described.robots] == [
        ("scout1", 1),
        ("scout2", 2),
        ("scout3", 3),
    ]
    assert described.robots[0].heading_rad == pytest.approx(math.pi / 2)
    assert described.targets[0].path == [(0.0, 3.0), (9.0, 3.0)]


def test_the_projects_target_rests_where_no_watching_scout_sees_it() -> None:
    [world] = read_mission(MISSION_XML).components
    described = msgspec.convert(world.parameters["world"], WorldDescription)
    half_view_rad, radius_m = math.radians(20.0), 0.2
    for scout in described.robots[:2]:
        for x_m, y_m in described.targets[0].path:
            distance_m = math.hypot(x_m - scout.x_m, y_m - scout.y_m)
            off_rad = abs(math.atan2(y_m - scout.y_m, x_m - scout.x_m) - scout.heading_rad)
            assert off_rad - math.asin(radius_m / distance_m) > half_view_rad


def test_reading_a_mission_changes_no_shipped_type_for_the_next() -> None:
    before = copy.deepcopy(shipped_types())
    read_mission(MISSION_XML)
    assert shipped_types() == before
