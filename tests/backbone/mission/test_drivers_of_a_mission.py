"""A driver that does not exist, or lacks a method, is refused before anything starts."""

from __future__ import annotations

from pathlib import Path

import pytest
from mission_files import changed, faults_in, read_text

from backbone.mission.class_probe import facts_of

RADIO = '<resource type="command_radio" name="radio" sharable="true" capacity="0.5"'
GRABBER = '<resource type="framegrabber" name="grabber"'
SCOUT = '<resource type="scout" name="scout1" features="camera"'
ID = '<parameter name="network_id" value="1"/>'
BODY = '    <robot name="scout1" x-m="1" y-m="1"/>\n'
OWN = """
import msgspec
class Options(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    port: str
class Whole:
    options_type = Options
    def __init__(self, site): ...
    async def open(self): ...
    async def transmit(self, network_id, payload, **named): ...
    async def close(self): ...
class Bare(Whole):
    def __init__(self): ...
class Plain(Whole):
    def close(self): ...
class Old(Whole):
    async def transmit(self, network_id, payload, *, arc, robot_epoch): ...
class Half:
    async def open(self): ...
    async def transmit(self, network_id, payload, **named): ...
NONE = 3
"""


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "own_radio.py").write_text(OWN)
    (tmp_path / "own_broken.py").write_text("import no_such_module\nclass Radio: ...")
    return tmp_path


@pytest.mark.parametrize(
    ("before", "driver", "message"),
    [
        (RADIO, "simulatd", "command_radio has no driver 'simulatd' (did you mean 'simulated'?)"),
        (GRABBER, "growth", "framegrabber has no driver 'growth'"),
        (SCOUT, "growth", "scout has no driver 'growth'"),
        (RADIO, "own_rdio:Whole", "own_rdio:Whole: no module own_rdio"),
        (RADIO, "own_radio:Whle", "own_radio:Whle: no class Whle in own_radio (did you mean 'Whole'?)"),
        (RADIO, "own_radio:Half", "radio cannot use this driver: radio driver: own_radio:Half lacks close"),
        (
            RADIO,
            "own_radio:Bare",
            "radio cannot use this driver: radio driver: own_radio:Bare: too many positional arguments; "
            "its constructor gets one argument, the DriverSite",
        ),
        (
            RADIO,
            "own_radio:Plain",
            "radio cannot use this driver: radio driver: own_radio:Plain: close is a 'def'; "
            "write it as an 'async def', as RadioDriver does",
        ),
        (
            RADIO,
            "own_radio:Old",
            "radio cannot use this driver: radio driver: own_radio:Old: transmit: "
            "got an unexpected keyword argument 'robot_stop'; RadioDriver has "
            "transmit(self, network_id, payload, arc=…, robot_epoch=…, robot_stop=…)",
        ),
        (RADIO, "own_radio:NONE", "radio cannot use this driver: radio driver: own_radio:NONE is no class"),
        (
            RADIO,
            "own_broken:Radio",
            "radio cannot use this driver: radio driver: own_broken:Radio: "
            "ModuleNotFoundError: No module named 'no_such_module' (OWN/own_broken.py, line 1)",
        ),
        (SCOUT, "resource_pool.drivers.interface:NoDevice", None),
    ],
)
def test_a_driver_that_cannot_work_is_refused(own: Path, before: str, driver: str, message: str | None) -> None:
    body = [(BODY, "")] if before == SCOUT else []
    [fault] = faults_in(own, changed((before, f'{before} driver="{driver}"'), *body))
    lacks = "clip_wheel_speed, drive, halt, jump, safe, transmitter"
    expected = message and message.replace("OWN", str(own))
    assert fault.message == (expected or f"scout1 cannot use this driver: robot driver: {driver} lacks {lacks}")
    assert fault.remedy


def test_a_robots_driver_is_the_one_in_its_parameter_protocol(own: Path) -> None:
    def scout(protocol: str) -> str:
        given = f'<parameter name="protocol" value="{protocol}"/>'
        return changed((SCOUT, f'{SCOUT} driver="serial"'), (ID, ID + given), (BODY, ""))

    read_text(own, scout("resource_pool.drivers.simulated:SimulatedScoutProtocol"))
    [fault] = faults_in(own, scout("growth"))
    assert fault.message == "scout has no driver 'growth'"
    assert scout("growth").splitlines()[fault.line - 1][fault.column - 1 :].startswith("value")


@pytest.mark.parametrize(
    ("path", "parameter"),
    [
        ("resource_pool.robots.rover.rc:RoverRc", 'protocol" value="resource_pool.robots.rover.rc:RoverProtocol'),
        (
            "resource_pool.devices.pan_camera.rc:VideoCamera",
            'protocol" value="resource_pool.devices.pan_camera.rc:PanProtocol',
        ),
    ],
)
def test_a_robot_without_the_protocol_that_its_commands_need_is_refused(own: Path, path: str, parameter: str) -> None:
    """Else its first command ends its RC."""

    def mission(given: str) -> str:
        cart_type = f'<type name="cart" class="{path}" subsystem="resource_pool" uses="command_radio"/>'
        cart = f'<resource type="cart" name="cart1" driver="serial">{given}</resource>'
        return changed(("  </types>", f"{cart_type}</types>"), ("  <resources>", f"<resources>{cart}"))

    given = '<uses type="command_radio" name="radio"/><parameter name="network_id" value="9"/>'
    [fault] = faults_in(own, mission(given))
    assert fault.message == "cart has no driver 'serial'"
    assert fault.remedy == 'Add <parameter name="protocol" value="package.module:Class"/>; built in: none'
    read_text(own, mission(f'{given}<parameter name="{parameter}"/>'))


def test_options_of_a_driver_of_ones_own_are_checked(own: Path) -> None:
    def radio(option: str) -> str:
        whole = f'{RADIO} driver="own_radio:Whole"'
        return changed((f"{RADIO}/>", f'{whole}><parameter name="{option}" value="/dev/ttyUSB0"/></resource>'))

    read_text(own, radio("port"))
    faults = [fault.message for fault in faults_in(own, radio("prt"))]
    assert faults == [
        "command_radio radio lacks parameter port",
        "command_radio has no parameter 'prt' (did you mean 'port'?)",
    ]


@pytest.mark.parametrize(
    ("driver", "options", "fault"),
    [
        ("serial_radio", [("port", "/dev/ttyUSB0"), ("baud", "57600"), ("extra_s", "0.01")], ""),
        ("serial_radio", [], "radio lacks parameter port"),
        ("serial_radio", [("port", "/dev/ttyUSB0"), ("baud", "12345")], "baud='12345' is illegal"),
        ("serial_radio", [("port", "/dev/ttyUSB0"), ("bits_per_s", "9600")], "has no parameter 'bits_per_s'"),
        ("video_device", [], ""),
        ("video_device", [("device", "0"), ("width_px", "640")], ""),
        ("video_device", [("device", "/dev/video2")], ""),
        ("video_device", [("device", "-1")], "device='-1' is illegal"),
        ("video_device", [("height_px", "9000")], "height_px='9000' is illegal"),
        ("video_device", [("capture_delay_s", "0.1")], "has no parameter 'capture_delay_s'"),
        ("recorded", [("file", "corridor.mp4"), ("loop", "true")], ""),
        ("recorded", [("loop", "true")], "grabber lacks parameter file"),
        ("recorded", [("file", "corridor.mp4"), ("loop", "twice")], "loop='twice' is illegal"),
    ],
    ids=str,
)
def test_options_of_the_drivers_of_real_devices_are_checked(
    tmp_path: Path, driver: str, options: list[tuple[str, str]], fault: str
) -> None:
    given = "".join(f'\n<parameter name="{name}" value="{value}"/>' for name, value in options)
    if driver == "serial_radio":
        text = changed((f"{RADIO}/>", f'{RADIO} driver="{driver}">{given}</resource>'))
    else:
        text = changed((f"{GRABBER}>", f'{GRABBER} driver="{driver}">{given}'))
    if not fault:
        assert read_text(tmp_path, text).resources
        return
    [found] = faults_in(tmp_path, text)
    assert fault in found.message
    wrong = f"{options[-1][0]}" if "lacks" not in fault else f'driver="{driver}"'
    assert wrong in text.splitlines()[found.line - 1]


def test_drivers_on_other_machines_are_not_looked_for_here(own: Path) -> None:
    elsewhere = ('address="127.0.0.1"', 'address="192.0.2.1"')
    read_text(own, changed(elsewhere, (RADIO, f'{RADIO} driver="not_here.at_all:Radio"')))


COMMANDS = """
import msgspec
from backbone.wire import Message
from resource_pool.commands import Command, Move as ShippedMove
from resource_pool.resource_controller import RcParameters, ResourceController

class Turn(Command, frozen=True):
    angle_rad: float = 0.0

class Move(Command, frozen=True):
    pass

class Connect(Command, frozen=True):
    pass

class Degrees(msgspec.Struct):
    pass

class Table(ResourceController[RcParameters]):
    commands = {commands}
    limits = {limits}
    async def obey(self, hold, order): return {{}}
"""


@pytest.mark.parametrize(
    ("commands", "limits", "message"),
    [
        ("Turn", "{'angle_rad': (-1.0, 1.0)}", ""),
        ("Turn", "{'angel_rad': (-1.0, 1.0)}", "limits has 'angel_rad', which no command has"),
        ("Turn", "{'angle_rad': (1.0, -1.0)}", "limits of angle_rad: 1 is above -1"),
        ("Turn | Degrees", "{}", "commands has Degrees, which is no command; derive it from Command"),
        ("Move | ShippedMove", "{}", "resource_pool.commands:Move, and own_table has a message of this name"),
        ("Turn | Connect", "{}", "commands has own_table:Connect, and backbone.rc_manager.messages has a message"),
    ],
    ids=["right", "name", "empty", "struct", "twice", "base"],
)
def test_commands_and_limits_that_cannot_work_are_refused(
    own: Path, commands: str, limits: str, message: str, request: pytest.FixtureRequest
) -> None:
    """Else a robot drives beyond its limits, or its RC ends at its start."""
    module = f"own_table_{request.node.callspec.id}"
    (own / f"{module}.py").write_text(COMMANDS.format(commands=commands, limits=limits))
    table = f'<type name="table" class="{module}:Table" subsystem="resource_pool"/>'
    text = changed(("  </types>", f"{table}</types>"))
    if not message:
        read_text(own, text)
        return
    [fault] = faults_in(own, text)
    assert message.replace("own_table", module) in fault.message


DEAF = """
from resource_pool.commands import Command, Halt, Move
from resource_pool.rcs.robot import RobotParameters, RobotRc
from resource_pool.resource_controller import RcParameters, ResourceController

class Turn(Command, frozen=True): ...

class Table(ResourceController[RcParameters]):
    commands = Turn

class Standing(RobotRc[RobotParameters]):
    commands = Halt

class Cart(RobotRc[RobotParameters]):
    commands = Halt | Move

class Driven(Cart):
    async def obey(self, hold, order): return {}

class NoTuple(Driven):
    obeyed = Turn
    async def obey(self, hold, order): return {}

class Words(NoTuple):
    obeyed = ("turn",)
    async def obey(self, hold, order): return {}

class Nothing(NoTuple):
    obeyed = None
    async def obey(self, hold, order): return {}
"""


@pytest.mark.parametrize(("name", "lacking"), [("Table", "Turn"), ("Cart", "Move"), ("Standing", ""), ("Driven", "")])
def test_an_rc_that_carries_out_no_command_is_refused(own: Path, name: str, lacking: str) -> None:
    """Its first command was refused, while a mission ran."""
    (own / "own_deaf.py").write_text(DEAF)
    failure = facts_of(f"own_deaf:{name}").failure
    assert failure == (f"commands has {lacking}, and no obey carries it out" if lacking else "")


@pytest.mark.parametrize("name", ["NoTuple", "Words", "Nothing"])
def test_an_rc_whose_obeyed_is_no_tuple_of_commands_is_refused_with_the_name_of_the_attribute(
    own: Path, name: str
) -> None:
    (own / "own_deaf.py").write_text(DEAF)
    failure = facts_of(f"own_deaf:{name}").failure
    assert f"obeyed of {name} is " in failure
    assert failure.endswith("; write a tuple of command classes")


def test_a_class_whose_file_is_no_python_is_not_called_missing(own: Path) -> None:
    (own / "own_slip.py").write_text("\nclass Rad:\n    def open(self:\n")
    [fault] = faults_in(own, changed((RADIO, f'{RADIO} driver="own_slip:Radio"')))
    assert fault.message.startswith("own_slip:Radio: its module cannot be imported: SyntaxError: ")
    assert fault.message.endswith(f"({own}/own_slip.py, line 3)")
    assert fault.remedy == "Mend its module"
