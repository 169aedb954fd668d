"""A mission file is read whole or refused whole, with every fault at its place."""

import json
import re
from pathlib import Path

import msgspec
import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from mission_files import (
    BROKEN,
    HERE,
    MISSION_XML,
    SMALL,
    announced,
    changed,
    faults_in,
    faults_of,
    faults_of_broken,
    read_text,
)
from record_messages import MESSAGES, messages

from backbone.mission.behavior_orders import behavior_orders
from backbone.mission.document import MAX_BYTES, MAX_DEPTH, MAX_ELEMENTS
from backbone.mission.model import HUB_PORT, MissionDescription
from backbone.mission.reader import MissionInvalid, read_mission, read_mission_bytes
from backbone.mission.tables import parameter_value
from backbone.naming import MAX_NAME_LENGTH

EXAMPLES = MISSION_XML.parent / "docs" / "examples"


SMALL_TREE = (
    '<mission name="tree" priority="1"><hosts><host name="base" address="127.0.0.1"/></hosts>'
    "<behaviors>{}</behaviors></mission>"
)


@pytest.mark.parametrize("path", BROKEN, ids=lambda path: path.stem)
def test_every_fault_of_a_broken_file_is_told_with_its_place(path: Path) -> None:
    assert [f"{fault.line}:{fault.column}: {fault.message}" for fault in faults_of_broken(path)] == announced(path)


@pytest.mark.parametrize("path", BROKEN, ids=lambda path: path.stem)
def test_every_fault_has_a_remedy_and_the_faults_are_told_in_order(path: Path) -> None:
    faults = faults_of_broken(path)
    assert all(fault.remedy and fault.file == str(path) for fault in faults)
    assert [(fault.line, fault.column) for fault in faults] == sorted((fault.line, fault.column) for fault in faults)


def test_there_are_enough_broken_files_and_each_announces_a_fault() -> None:
    assert len(BROKEN) >= 60
    assert all(announced(path) for path in BROKEN)


def test_an_invalid_mission_tells_every_fault_one_a_line() -> None:
    path = HERE / "broken" / "many-at-once.xml"
    with pytest.raises(MissionInvalid) as caught:
        read_mission(path)
    lines = str(caught.value).splitlines()
    assert len(lines) == len(caught.value.faults) == 8
    assert lines[1] == f"{path}:19:28: no host is named 'bse' (did you mean 'base'?) (There is: base)"


def test_every_message_is_one_that_was_read_and_found_good() -> None:
    """A message that changes shows in ``messages.json``, once ``record_messages.py`` has run."""
    assert messages() == json.loads(MESSAGES.read_text())


def test_a_file_that_is_not_there_is_a_fault(tmp_path: Path) -> None:
    [fault] = faults_of(tmp_path / "nowhere.xml")
    assert (fault.line, fault.column) == (1, 1)
    assert "No such file" in fault.message


def test_a_folder_and_an_empty_file_are_faults(tmp_path: Path) -> None:
    assert "is no file" in faults_of(tmp_path)[0].message
    assert "no element found" in faults_in(tmp_path, "")[0].message


def test_a_device_that_never_ends_is_refused_unread() -> None:
    assert "is no file" in faults_of("/dev/zero")[0].message


def test_a_huge_file_is_refused_by_its_size(tmp_path: Path) -> None:
    [fault] = faults_in(tmp_path, b"<mission>" + b" " * MAX_BYTES)
    assert "is larger than" in fault.message


def test_too_many_and_too_deep_elements_are_refused_where_they_begin(tmp_path: Path) -> None:
    [many] = faults_in(tmp_path, "<mission>" + "<host/>" * (MAX_ELEMENTS + 1) + "</mission>")
    assert "more than" in many.message
    [deep] = faults_in(tmp_path, "<mission>" + "<a>" * MAX_DEPTH + "</a>" * MAX_DEPTH + "</mission>")
    assert (deep.line, deep.column) == (1, len("<mission>") + len("<a>") * (MAX_DEPTH - 1) + 1)


def test_bytes_that_are_no_utf_8_are_refused_where_they_stand(tmp_path: Path) -> None:
    [fault] = faults_in(tmp_path, b"<!-- one -->\n<!-- \xff -->\n<mission/>")
    assert (fault.line, fault.column) == (2, 6)


def test_too_many_children_are_refused_with_both_limits(tmp_path: Path) -> None:
    wait = '<behavior type="wait" name="w{}" priority="1"><parameter name="seconds" value="1"/></behavior>'
    inside = "".join(map(wait.format, range(257)))
    text = SMALL_TREE.format(f'<behavior type="sequence" name="all" priority="1">{inside}</behavior>')
    [fault] = faults_in(tmp_path, text)
    assert (fault.message, fault.remedy) == ("sequence all has 257 behaviors inside", "Give it 1 to 256")


@pytest.mark.parametrize("kind", ["drive", "scout", "placer"])
def test_a_type_that_is_no_behavior_is_one_fault(tmp_path: Path, kind: str) -> None:
    text = SMALL_TREE.format(f'<behavior type="{kind}" name="own" priority="1"/>')
    [fault] = faults_in(tmp_path, text)
    assert fault.message == f"type {kind} is no behavior"


def test_a_behavior_whose_class_is_none_is_refused(tmp_path: Path) -> None:
    own = '<type name="own" subsystem="mission_control" class="backbone.component.component:Component"/>'
    text = SMALL_TREE.format('<behavior type="own" name="first" priority="1"/>')
    [fault] = faults_in(tmp_path, text.replace("<behaviors>", f"<types>{own}</types><behaviors>"))
    assert fault.message == "type own is no behavior: its class backbone.component.component:Component is none"


def test_a_class_with_other_letters_is_refused_with_the_legal_ones(tmp_path: Path) -> None:
    text = SMALL.read_text().replace(
        "<types>", '<types><type name="own" subsystem="mission_control" class="weg.größe:Größe"/>'
    )
    fault, _no_module = faults_in(tmp_path, text)
    assert fault.message.startswith("class='weg.größe:Größe' in <type> is illegal")
    assert "each name of the letters A to Z and a to z, digits and '_'; no other letters" in fault.remedy


@pytest.mark.parametrize("most", ["0", "99999999999"])
def test_an_illegal_size_of_a_value_names_the_legal_ones(tmp_path: Path, most: str) -> None:
    quality = f'<modules><quality key="ball" most-bytes="{most}"/></modules>'
    faults = faults_in(tmp_path, f'<mission name="small" priority="1">{quality}</mission>')
    assert any("1 to 67108864" in fault.remedy for fault in faults)


@pytest.mark.parametrize("encoding", ["utf-16", "iso-8859-1"])
def test_other_encodings_are_refused(tmp_path: Path, encoding: str) -> None:
    text = f'<?xml version="1.0" encoding="{encoding}"?>\n{SMALL.read_text()}'
    [fault] = faults_in(tmp_path, text.encode(encoding))
    assert "UTF-8" in fault.remedy


@pytest.mark.parametrize("encoding", ["utf-16-le", "utf-16-be"])
def test_utf_16_without_mark_and_declaration_is_refused(tmp_path: Path, encoding: str) -> None:
    [fault] = faults_in(tmp_path, '<mission name="small" priority="1"/>'.encode(encoding))
    assert (fault.line, fault.remedy) == (1, "Save the file in UTF-8")


def test_a_byte_order_mark_is_no_fault(tmp_path: Path) -> None:
    assert read_text(tmp_path, b"\xef\xbb\xbf" + SMALL.read_bytes()).name == "small"


@given(st.text())
@settings(max_examples=share(60))
def test_no_text_makes_the_reader_fail_in_another_way(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    file = tmp_path_factory.mktemp("any") / "m.xml"
    file.write_bytes(text.encode(errors="replace"))
    with pytest.raises(MissionInvalid):
        read_mission(file)


@given(st.integers(0), st.integers(0, 60), st.text(max_size=12))
@settings(max_examples=share(150))
def test_a_piece_of_a_good_file_replaced_by_anything_is_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, where: int, length: int, instead: str
) -> None:
    good = SMALL.read_text()
    start = where % len(good)
    file = tmp_path_factory.getbasetemp() / "replaced.xml"
    file.write_bytes((good[:start] + instead + good[start + length :]).encode(errors="replace"))
    try:
        read = read_mission(file)
    except MissionInvalid:
        return
    assert isinstance(read, MissionDescription)


@pytest.mark.parametrize("digits", [13, 20, 200, 400])
@pytest.mark.parametrize(
    ("name", "before"),
    [
        ("deployment.xml", 'point x-m="'),
        ("deployment.xml", 'heading-deg="'),
        ("deployment.xml", 'height-m="'),
        ("battery.xml", 'name="below" value="'),
        ("battery.xml", 'period-s="'),
    ],
)
def test_a_number_that_is_far_too_large_is_a_fault_at_its_place(name: str, before: str, digits: int) -> None:
    good = (EXAMPLES / name).read_text()
    begin, between, end = good.partition(before)
    text = f"{begin}{between}{'9' * digits}{end[end.index(chr(34)) :]}"
    with pytest.raises(MissionInvalid) as refused:
        read_mission_bytes(text.encode(), str(EXAMPLES / name), {})
    assert begin.count("\n") + 1 in {fault.line for fault in refused.value.faults}


def test_columns_count_characters_not_bytes(tmp_path: Path) -> None:
    [fault] = faults_in(tmp_path, changed(('<host name="base"', '<!-- äöü€ --><host nam="base"'), ("<!-- A", "<!-- Ä")))
    line = changed(('<host name="base"', '<!-- äöü€ --><host nam="base"')).splitlines()[fault.line - 1]
    assert line[fault.column - 1 :].startswith("nam=")


def test_an_attribute_is_found_though_another_value_looks_like_it(tmp_path: Path) -> None:
    text = changed(('<parameter name="view_s" value="12"/>', "<parameter value=' name=\"x\" ' name='no name'/>"))
    [fault] = faults_in(tmp_path, text)
    assert text.splitlines()[fault.line - 1][fault.column - 1 :].startswith("name='no name'")


def test_core_services_come_in_the_papers_order_whatever_order_they_are_written_in(tmp_path: Path) -> None:
    services = re.findall(r"    <service .*\n", SMALL.read_text())
    description = read_text(tmp_path, changed(("".join(services), "".join(reversed(services)))))
    assert [service.type for service in description.core] == [
        "nameserver",
        "component_database",
        "placer",
        "creator",
        "dependency_database",
        "rc_manager",
    ]


def test_sections_and_what_stands_in_them_may_come_in_any_order(tmp_path: Path) -> None:
    text = SMALL.read_text()
    sections = re.findall(r"^  <(\w+)>.*?^  </\1>\n", text, re.MULTILINE | re.DOTALL)
    assert len(sections) == 6
    hosts = re.search(r"  <hosts>.*</hosts>\n", text, re.DOTALL)
    room = re.search(r"    <room .*\n", text)
    assert hosts is not None
    assert room is not None
    moved = text.replace(hosts[0], "").replace("</mission>", hosts[0] + "</mission>")
    moved = moved.replace(room[0], "").replace("  </world>", room[0] + "  </world>")
    ordered, other = read_text(tmp_path, text), read_text(tmp_path, moved)
    assert msgspec.to_builtins(ordered) == msgspec.to_builtins(other)


def test_what_is_left_out_gets_its_default() -> None:
    description = read_mission(SMALL)
    [watch1, _watch2] = description.behaviors
    assert watch1.arc is not None
    assert (watch1.arc.period_s, watch1.arc.packet_time_s, watch1.arc.maximum_runtime_s) == (0.05, 0.002, 0.0)
    grabber = next(resource for resource in description.resources if resource.name == "grabber")
    assert (grabber.driver, grabber.capacity, grabber.sharable, grabber.host) == ("simulated", 1.0, False, "")
    assert description.components[0].name == "world"


def test_a_simulated_resource_is_told_its_world_a_real_one_is_not(tmp_path: Path) -> None:
    real = changed(('name="video1" connect-s="0.3"', 'name="video1" driver="modulator"'))
    played = {resource.name: resource.parameters for resource in read_text(tmp_path, real).resources}
    assert played["scout1"] == {"world": "world", "network_id": 1}
    assert played["video1"] == {}


@pytest.mark.parametrize(
    ("written", "value"),
    [
        ("15", 15),
        ("-0.5", -0.5),
        ("1e-3", 0.001),
        ("true", True),
        ("false", False),
        ("True", "True"),
        ("NaN", "NaN"),
        ("9223372036854775807", 2**63 - 1),
        ("9223372036854775808", "9223372036854775808"),
        ("1e300", "1e300"),
        ("null", "null"),
        ("[1, 2]", "[1, 2]"),
        ("/dev/video0", "/dev/video0"),
        ("", ""),
    ],
)
def test_a_parameter_is_a_number_or_truth_value_if_it_reads_as_one(written: str, value: object) -> None:
    read = parameter_value(written)
    assert (read, type(read)) == (value, type(value))


def test_what_shares_a_process_says_so_in_its_order(tmp_path: Path) -> None:
    mission = read_text(
        tmp_path,
        changed(
            ('name="radio"', 'name="radio" process="pool"'),
            ("<world>", '<world process="pool">'),
            ('name="watch1"', 'name="watch1" process="eyes"'),
        ),
    )
    assert {resource.name: resource.process for resource in mission.resources if resource.process} == {"radio": "pool"}
    assert [component.process for component in mission.components] == ["pool"]
    assert [order.process for order in behavior_orders(mission)] == ["eyes", ""]


def test_members_of_a_process_are_on_the_host_that_one_of_them_names(tmp_path: Path) -> None:
    """Placed one by one, a member without a host once began its process elsewhere before the others came."""
    text = MISSION_XML.read_text().replace('name="radio" sharable', 'name="radio" host="base" sharable')
    file = tmp_path / "mission.xml"
    file.write_text(text)
    hosts = {(each.process, each.host) for each in read_mission(file).resources}
    assert hosts == {("hardware", "base"), ("", "")}


def test_a_driver_is_named_or_given_by_its_class(tmp_path: Path) -> None:
    lamp = '<type name="lamp" class="resource_pool.rcs.skeleton:Lamp" subsystem="resource_pool"/>\n  </types>'
    driver = "resource_pool.rcs.skeleton:PaintedLamp"
    resource = (
        f'<resource type="lamp" name="lamp1" driver="{driver}"><parameter name="color" value="green"/></resource>'
    )
    text = changed(("  </types>", lamp), ("  </resources>", f"{resource}</resources>"))
    lamp1 = read_text(tmp_path, text).resources[-1]
    assert (lamp1.driver, lamp1.parameters) == (driver, {"color": "green"})
    [fault] = faults_in(tmp_path, text.replace(driver, "Painted Lamp"))
    assert "driver='Painted Lamp' in <resource> is illegal" in fault.message


def test_a_creator_on_another_host_is_fine(tmp_path: Path) -> None:
    description = read_text(
        tmp_path,
        changed(
            ('address="127.0.0.1"', 'address="192.0.2.1" port="7448"'),
            ("  </hosts>", '    <host name="attic" address="robot-attic.example.org"/>\n  </hosts>'),
            ("<core>", '<core><service type="creator" host="attic"/>'),
        ),
    )
    assert [service.host for service in description.core if service.type == "creator"] == ["base", "attic"]
    assert (description.hosts[0].port, description.hosts[1].port) == (7448, HUB_PORT)
    assert [host.name for host in description.other_hosts] == ["attic"]


def test_classes_on_other_machines_are_not_looked_for_here(tmp_path: Path) -> None:
    text = changed(
        ('address="127.0.0.1"', 'address="192.0.2.1"'),
        ("  </hosts>", '    <host name="attic" address="192.0.2.7"/>\n  </hosts>'),
        ("<core>", '<core><service type="creator" host="attic"/>'),
        ('class="mission_control.behaviors.watch_for_motion:WatchForMotion"', 'class="only_there.watch:Watch"'),
    )
    assert "only_there.watch:Watch" in {kind.class_path for kind in read_text(tmp_path, text).types}


def test_an_arc_whose_name_would_be_too_long_is_refused(tmp_path: Path) -> None:
    long = "w" * (MAX_NAME_LENGTH - len("-drive") + 1)
    [fault] = faults_in(tmp_path, changed(('name="watch2"', f'name="{long}"')))
    assert "too long" in fault.message


def test_the_last_branch_is_none_of_the_roots_that_start_with_the_mission() -> None:
    mission = read_mission(HERE.parents[2] / "docs" / "examples" / "home-at-the-end.xml")
    assert [order.name for order in behavior_orders(mission)] == ["patrol"]
    assert mission.last is not None
    assert (mission.last.behavior.name, mission.last.within_s) == ("end-of-day", 60.0)
    assert [child.name for child in mission.last.behavior.children] == ["drive-home"]
    assert mission.at_the_end is not None
    assert [one.name for one in mission.at_the_end.behaviors] == ["end-of-day"]


def test_a_mission_has_no_last_branch_and_one_without_a_time_has_a_minute(tmp_path: Path) -> None:
    assert read_mission(MISSION_XML).last is None
    text = (HERE.parents[2] / "docs" / "examples" / "home-at-the-end.xml").read_text()
    file = tmp_path / "m.xml"
    file.write_text(text.replace(' within-s="60"', ""))
    last = read_mission(file).last
    assert last is not None
    assert last.within_s == 60.0
