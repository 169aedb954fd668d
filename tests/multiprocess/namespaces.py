"""Several machines on one: network namespaces joined by a switch, made and removed by the test alone.

Nothing of it touches the machine's own network. The namespaces share files and process numbers, so a test gives
each host a folder of its own, and finds a host's processes by their namespace.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Collection, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import poor_link
import psutil
import pytest
from poor_link import INNER, OUTER, Weather

SUBNET = "10.99.7"
_networks = itertools.count()
IP = shutil.which("ip") or "/usr/sbin/ip"


@dataclass(frozen=True)
class NetworkHost:
    """One machine of the test's network.

    Attributes:
        name: Its name, and its folder's.
        namespace: Its network namespace.
        address: Its IP address.
        folder: A folder of its own; commands run in it.
        switch: The namespace of the switch it hangs on.
        link: Carries the frames of a machine behind a poor link; None: a cable.
    """

    name: str
    namespace: str
    address: str
    folder: Path
    switch: str
    link: subprocess.Popen[str] | None = None

    def start(self, command: list[str], environment: dict[str, str], **more: object) -> subprocess.Popen[str]:
        """Start a command on this machine; it speaks with others over the switch only."""
        self.runtime_folder.mkdir(mode=0o700, exist_ok=True)
        words = [IP, "netns", "exec", self.namespace, *command]
        own = {**environment, "XDG_RUNTIME_DIR": str(self.runtime_folder)}
        return subprocess.Popen(words, env=own, cwd=self.folder, text=True, **more)  # type: ignore[call-overload]

    @property
    def runtime_folder(self) -> Path:
        """Where this machine keeps the files of its missions."""
        return self.folder / "run"

    def cut(self) -> None:
        """Pull this machine's cable out of the switch."""
        _ip("-n", self.switch, "link", "set", self._port, "down")

    def heal(self) -> None:
        """Put the cable back."""
        _ip("-n", self.switch, "link", "set", self._port, "up")

    def change_address(self, address: str) -> None:
        """Replace this machine's address, as a network may that gives it another one."""
        words = [IP, "-n", self.namespace, "-4", "-brief", "address", "show", "eth0"]
        listed = subprocess.run(words, capture_output=True, text=True, check=True)
        _ip("-n", self.namespace, "address", "del", listed.stdout.split()[2], "dev", "eth0")
        _ip("-n", self.namespace, "address", "add", f"{address}/24", "dev", "eth0")

    def change_weather(self, weather: Weather) -> None:
        """Let the poor link of this machine lose, delay, limit or stall frames from now on."""
        assert self.link is not None, f"{self.name} hangs on a cable"
        assert self.link.stdin is not None
        print(json.dumps(asdict(weather)), file=self.link.stdin, flush=True)

    def processes(self) -> list[psutil.Process]:
        """Return what runs on this machine."""
        done = subprocess.run([IP, "netns", "pids", self.namespace], capture_output=True, text=True, check=True)
        found = []
        for pid in done.stdout.split():
            with contextlib.suppress(psutil.Error):
                process = psutil.Process(int(pid))
                if process.status() != psutil.STATUS_ZOMBIE:
                    found.append(process)
        return found

    def listens_at(self) -> list[str]:
        """Return the addresses and TCP ports at which something of this machine listens."""
        words = [IP, "netns", "exec", self.namespace, "ss", "--listening", "--tcp", "--numeric", "--no-header"]
        done = subprocess.run(words, capture_output=True, text=True, check=True)
        return sorted(line.split()[3] for line in done.stdout.splitlines())

    def die(self) -> None:
        """Lose power: every process of this machine is gone at once."""
        for process in self.processes():
            with contextlib.suppress(psutil.Error):
                process.send_signal(signal.SIGKILL)

    @property
    def _port(self) -> str:
        return f"to-{self.name}"


@contextlib.contextmanager
def hosts_on_a_switch(folder: Path, *names: str, poor: Collection[str] = ()) -> Iterator[dict[str, NetworkHost]]:
    """Give machines of these names, each with an address, joined by a switch; nothing of them is left afterwards.

    Between a machine in ``poor`` and the switch is a poor link, with good weather at first.
    The test is skipped where namespaces cannot be made.
    """
    if os.geteuid() != 0:
        pytest.skip("only root makes network namespaces")
    if not Path(IP).exists():
        pytest.skip("no 'ip' on this machine: apt-get install iproute2")
    network = f"scout-{os.getpid()}-{next(_networks)}"  # a process may have several networks at a time
    switch = f"{network}-switch"
    hosts = {}
    made = []
    try:
        for name in ("switch", *names):
            _make_or_skip("netns", "add", f"{network}-{name}")
            made.append(f"{network}-{name}")
        _make_or_skip("-n", switch, "link", "add", "bridge", "type", "bridge")
        _ip("-n", switch, "link", "set", "bridge", "up")
        for number, name in enumerate(names, start=1):
            link = _poor_link(network, name, made) if name in poor else None
            host = NetworkHost(name, f"{network}-{name}", f"{SUBNET}.{number}", folder / name, switch, link)
            hosts[name] = host
            host.folder.mkdir()
            _plug_in(host)
        yield hosts
    finally:
        for host in hosts.values():
            host.die()
            if host.link is not None:
                host.link.kill()
                host.link.communicate()
        for namespace in reversed(made):
            _ip("netns", "del", namespace)


def _poor_link(network: str, name: str, made: list[str]) -> subprocess.Popen[str]:
    """Make a namespace with both ends of a link, and start the program that carries frames between them."""
    space = f"{network}-{name}-link"
    _make_or_skip("netns", "add", space)
    made.append(space)
    for near, far in ((INNER, "eth0"), (OUTER, "port")):
        _ip("-n", space, "link", "add", near, "type", "veth", "peer", "name", far)
        _ip("-n", space, "link", "set", near, "up")
    words = [IP, "netns", "exec", space, sys.executable, poor_link.__file__, "7", "eth0", "port"]
    link = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert link.stdout is not None
    if link.stdout.readline() != "ready\n":
        link.kill()
        pytest.skip("this machine carries no frames between namespaces")
    return link


def _plug_in(host: NetworkHost) -> None:
    port = f"to-{host.name}"
    if host.link is None:
        _make_or_skip(
            "-n", host.switch, "link", "add", port, "type", "veth", "peer", "name", "eth0", "netns", host.namespace
        )
    else:
        _ip("-n", f"{host.namespace}-link", "link", "set", "eth0", "netns", host.namespace)
        _ip("-n", f"{host.namespace}-link", "link", "set", "port", "netns", host.switch, "name", port)
    _ip("-n", host.switch, "link", "set", port, "master", "bridge", "up")
    _ip("-n", host.namespace, "link", "set", "lo", "up")
    _ip("-n", host.namespace, "address", "add", f"{host.address}/24", "dev", "eth0")
    _ip("-n", host.namespace, "link", "set", "eth0", "up")


def _make_or_skip(*words: str) -> None:
    done = subprocess.run([IP, *words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        pytest.skip(f"this machine makes no network namespaces: ip {' '.join(words)}: {done.stderr.strip()}")


def _ip(*words: str) -> None:
    subprocess.run([IP, *words], capture_output=True, text=True, check=True)
