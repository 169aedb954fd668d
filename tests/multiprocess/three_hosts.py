"""A mission on three machines, brought up by the commands that ``up`` prints, and what runs where."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import os
import re
import shlex
import shutil
import subprocess
import sys
import threading
import time
import uuid
from collections import defaultdict
from collections.abc import AsyncIterator, Callable, Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import psutil
import pytest
from lxml import etree
from namespaces import NetworkHost, hosts_on_a_switch
from running_mission import MARK, MISSION_XML

from backbone.addresses import NAMESERVER
from backbone.authentication import secret_of, socket_endpoint
from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.component.messages import ComponentState
from backbone.errors import BackboneError
from backbone.mission.shipped_types import shipped_text
from backbone.nameserver.messages import Components, ListComponents
from backbone.naming import Subsystem, component_of

BIN = Path(sys.executable).parent
NAME = "three-hosts"
READY_WITHIN_S = 90.0
SAMPLE_EACH_S = 0.05
WAITING = re.compile(r"waiting for host (?P<host>\S+); copy the secret there and type: (?P<command>.*)")
SECRET = re.compile(r"the mission's secret, for its other hosts: (?P<path>.*)")
ARCS = {"watch-scout1-capture", "watch-scout2-capture"}  # they start a moment after all is ready
_LOOKERS = itertools.count()
"""A number for each that looks, because two buses of one name would count their messages twice."""
NO_COMPONENTS = re.compile(r"zygote-.*|scout-backbone|python.*|ip|sh|bash")


@dataclass
class Talk:
    """A command that runs, and the lines it said on standard error."""

    process: subprocess.Popen[str]
    lines: list[str] = field(default_factory=list)
    _reader: threading.Thread = field(default_factory=threading.Thread)

    @classmethod
    def of(cls, process: subprocess.Popen[str]) -> Talk:
        talk = cls(process)

        def read() -> None:
            assert process.stderr is not None
            with process.stderr as said:
                for line in said:
                    talk.lines.append(line.rstrip())

        talk._reader = threading.Thread(target=read, daemon=True)
        talk._reader.start()
        return talk

    def close(self) -> None:
        """Return when the command has ended and all it said is read."""
        self.process.wait(10)
        self._reader.join(10)


@dataclass
class ThreeHosts:
    """A mission on the hosts base, near and far.

    Attributes:
        hosts: The machines.
        environment: Of every command.
        file: The mission file.
        offers: The commands typed on near and far.
        names: What the mission consists of when it is whole.
        missing: What was not there when that was last asked.
        talks: Every command that was typed and let run.
        up: The command typed on base.
    """

    hosts: dict[str, NetworkHost]
    environment: dict[str, str]
    file: Path
    offers: dict[str, Talk] = field(default_factory=dict)
    names: frozenset[str] = frozenset()
    missing: list[str] = field(default_factory=list)
    talks: list[Talk] = field(default_factory=list)
    up: Talk = field(init=False)

    def story(self) -> str:
        """Return what all commands said, and the ends of all logs, for failure messages."""
        parts = [f"--- missing: {', '.join(self.missing)}", "--- up", *self.up.lines[-40:]]
        for name, offer in self.offers.items():
            parts += [f"--- offer {name}", *offer.lines[-20:]]
        for host in self.hosts.values():
            for log in sorted(host.runtime_folder.glob("scout-backbone/*/log/*.log")):
                with contextlib.suppress(OSError):
                    parts += [f"--- {host.name} {log.name}", *log.read_text(errors="replace").splitlines()[-8:]]
        return "\n".join(parts)

    def wait(self, what: str, holds: Callable[[], bool], within_s: float) -> float:
        """Return after how many seconds it held."""
        began_s = time.monotonic()
        while not holds():
            if time.monotonic() > began_s + within_s:
                there = f"not ready: {self.lacks()}; on the machines: {self.left()}"
                pytest.fail(f"not within {within_s} s: {what}; {there}\n{self.story()}")
            time.sleep(SAMPLE_EACH_S)
        return time.monotonic() - began_s

    def type_on_base(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run a command on base to its end."""
        process = self.hosts["base"].start(
            [str(BIN / words[0]), *words[1:]], self.environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE
        )
        out, said = process.communicate(timeout=60)
        return subprocess.CompletedProcess(words, process.returncode, out, said)

    def components(self) -> dict[str, ComponentState]:
        """Return the components by name; none while the hub does not answer."""
        try:
            return asyncio.run(self._components())
        except (BackboneError, OSError):
            return {}

    async def _components(self) -> dict[str, ComponentState]:
        async with self.bus(f"ui_console/looker-{next(_LOOKERS)}") as bus:
            listed = await bus.ask(NAMESERVER, ListComponents(), Components, within_s=5.0)
        return {component_of(state.address): state for state in listed.components}

    @contextlib.asynccontextmanager
    async def bus(self, source: str = "ui_console/tester") -> AsyncIterator[ZenohBus]:
        """Join through the unix socket, which no namespace hides from this machine's root."""
        folder = self.hosts["base"].runtime_folder / "scout-backbone" / NAME
        config = client_config(socket_endpoint(folder), secret_of(str(folder)))
        bus = await ZenohBus.open_when_up(NAME, source, MissionClock.started_now(), config)
        try:
            yield bus
        finally:
            await bus.close()

    def lacks(self) -> dict[str, str]:
        """Return the components of the mission that are not ready, and the state of each."""
        there = self.components()
        states = {name: there[name].state if name in there else "absent" for name in self.names}
        return {name: state for name, state in states.items() if state != "ready"}

    def is_whole(self) -> bool:
        """Say whether every component of the mission is there and ready."""
        return not self.lacks()

    def go_on_with(self, host: str, command: list[str]) -> Talk:
        """Type a command on that machine and let it run."""
        words = [str(BIN / command[0]), *command[1:]]
        process = self.hosts[host].start(words, self.environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        talk = Talk.of(process)
        self.talks.append(talk)
        return talk

    def type_up(self, *more: str) -> None:
        """Type ``up`` on base."""
        self.up = self.go_on_with("base", ["scout-backbone", "up", str(self.file), "--headless", *more])

    def type_what_up_prints(self, host: str) -> None:
        """Copy the secret, and type on that machine the command that ``up`` printed for it."""
        self.wait(f"up asks for {host}", lambda: host in self._asked_for(), 30.0)
        self.copy_the_secret_to(host)
        self.offers[host] = self.go_on_with(host, shlex.split(self._asked_for()[host]))

    def asks_for_the_secret(self) -> bool:
        """Say whether ``up`` waits for other machines."""
        return any(SECRET.search(line) for line in self.up.lines)

    def copy_the_secret_to(self, host: str) -> None:
        """Copy the file that ``up`` named to where the printed command looks for it."""
        secret = next(found["path"] for line in self.up.lines if (found := SECRET.search(line)))
        shutil.copy(secret, self.hosts[host].folder / "secret")

    def left(self) -> list[str]:
        """Return the processes of the mission on all machines, and the files and sockets it left."""
        running = [f"{host.name}: {p.pid} {p.name()}" for host in self.hosts.values() for p in host.processes()]
        files = [str(path) for host in self.hosts.values() for path in host.runtime_folder.glob("scout-backbone/*")]
        return running + files

    def _asked_for(self) -> dict[str, str]:
        return {found["host"]: found["command"] for line in self.up.lines if (found := WAITING.search(line))}


class Copies:
    """Watches all machines for components that run twice."""

    def __init__(self, hosts: dict[str, NetworkHost]) -> None:
        self._hosts, self._end = hosts, threading.Event()
        self._spaces = {os.stat(f"/var/run/netns/{host.namespace}").st_ino: host.name for host in hosts.values()}
        self._together_since_s: dict[str, float] = {}
        self.longest_s: dict[str, float] = defaultdict(float)
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> Copies:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join(10)

    def _watch(self) -> None:
        while not self._end.wait(SAMPLE_EACH_S):
            now_s = time.monotonic()
            twice = {name for name, hosts in self._where().items() if len(hosts) > 1}
            for name in twice:
                began_s = self._together_since_s.setdefault(name, now_s)
                self.longest_s[name] = max(self.longest_s[name], now_s - began_s)
            for name in [name for name in self._together_since_s if name not in twice]:
                del self._together_since_s[name]

    def _where(self) -> dict[str, list[str]]:
        found: dict[str, list[str]] = defaultdict(list)
        for pid in psutil.pids():
            with contextlib.suppress(OSError, psutil.Error):
                host = self._spaces.get(os.stat(f"/proc/{pid}/ns/net").st_ino)
                if host is None or Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z":
                    continue
                name = Path(f"/proc/{pid}/comm").read_text().strip()
                if not NO_COMPONENTS.fullmatch(name):
                    found[name].append(host)
        return found


def types_on(**names: str) -> str:
    """Return declarations of shipped types, ``tag="name name"``, each only for machines with its tag.

    Without a tag, their load decides where components begin.
    """
    shipped = {one.get("name"): one for one in etree.fromstring(shipped_text()).iter("type")}
    declared = ""
    for tag, those in names.items():
        for name in those.split():
            shipped[name].set("tags", tag)
            declared += etree.tostring(shipped[name], encoding="unicode")
    return f"<types>{declared}</types>"


def mission_text(hosts: dict[str, NetworkHost]) -> str:
    """Return the shipped mission for three machines: a robot's RC on near, another on far, the rest where it may."""
    text = re.sub(r'(<mission[^>]*?\bname=")[^"]*', rf"\g<1>{NAME}", MISSION_XML.read_text(), count=1)
    base = '<host name="base" address="127.0.0.1" tags="radio video"/>'
    assert base in text
    others = "".join(f'\n    <host name="{n}" address="{hosts[n].address}" tags="outdoors"/>' for n in ("near", "far"))
    text = text.replace(base, base.replace("127.0.0.1", hosts["base"].address) + others)
    for robot, host in (("scout1", "near"), ("scout2", "far")):
        own = f'name="{robot}" features="camera" driver="simulated" process="hardware"'
        assert own in text
        text = text.replace(own, f'name="{robot}" features="camera" driver="simulated" host="{host}"')
    for shared in ("radio", "video1"):
        text = re.sub(rf'(<resource [^>]*name="{shared}")', r'\1 host="base"', text)
    return text.replace('name="grabber" driver', 'name="grabber" host="base" driver')


@contextlib.contextmanager
def machines(
    folder: Path,
    *options: str,
    poor: Collection[str] = (),
    text: Callable[[dict[str, NetworkHost]], str] = mission_text,
) -> Iterator[ThreeHosts]:
    """Give three machines, with ``up`` and these options typed on base; nothing of them is left afterwards."""
    with hosts_on_a_switch(folder, "base", "near", "far", poor=poor) as hosts:
        file = hosts["base"].folder / "mission.xml"
        file.write_text(text(hosts))
        mission = ThreeHosts(hosts, {**os.environ, MARK: uuid.uuid4().hex}, file)
        mission.type_up(*options)
        try:
            yield mission
        finally:
            for host in hosts.values():
                host.die()
            for talk in mission.talks:
                talk.close()


@contextlib.contextmanager
def mission_on_three_hosts(
    folder: Path,
    *options: str,
    poor: Collection[str] = (),
    text: Callable[[dict[str, NetworkHost]], str] = mission_text,
    arcs: Collection[str] = ARCS,
) -> Iterator[ThreeHosts]:
    """Give the mission when it is whole; take it down afterwards, and see that nothing is left on any machine.

    Args:
        text: Returns the mission file.
        arcs: ARCs that it has.
    """
    with machines(folder, *options, poor=poor, text=text) as mission:
        for host in ("near", "far"):
            mission.type_what_up_prints(host)
        mission.wait(
            "all is ready", lambda: any(line.startswith("all ready") for line in mission.up.lines), READY_WITHIN_S
        )
        mission.wait("ARCs are there", lambda: mission.components().keys() >= set(arcs), 20.0)
        there = mission.components().items()
        mission.names = frozenset(name for name, c in there if not c.address.startswith(Subsystem.UI_CONSOLE))
        mission.wait("all are ready", mission.is_whole, 20.0)
        yield mission
        down = mission.type_on_base("scout-backbone", "down", "--mission", NAME)
        assert down.returncode == 0, down.stderr + mission.story()
        assert mission.up.process.wait(30) == 0, mission.story()
        for host, offer in mission.offers.items():
            try:
                assert offer.process.wait(10) == 0, f"{host}\n{mission.story()}"
            except subprocess.TimeoutExpired:
                pytest.fail(f"the offer of {host} goes on after down\n{mission.story()}")
        mission.wait("nothing is left", lambda: not mission.left(), 5.0)
