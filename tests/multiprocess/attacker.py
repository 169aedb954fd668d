"""A stranger on the machine: bare zenoh, another account, and everything that may be known of a mission.

Run as root with a JSON object on standard input; imports what it needs, gives up root for good, attacks so many
times, and prints what it reached. With ``"uid": 0`` it is the mission's own user and shows what the attacks would do.
"""

from __future__ import annotations

import itertools
import json
import os
import random
import signal
import socket
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import zenoh

from backbone.component.messages import SetParameter, Stop
from backbone.creator.messages import Spawn
from backbone.naming import Subsystem
from backbone.rc_manager.messages import AskSchedule
from backbone.scheduling.views import Schedule
from backbone.wire import WIRE_VERSION, Envelope, Message, Reader, Refused, write
from resource_pool.commands import Drive
from resource_pool.stop_messages import AskStop, LiftStop, StopState

PLACER = "backbone/placer"
GUESSES: list[dict[str, str]] = [
    {},
    {"user": "scout", "password": ""},
    {"user": "scout", "password": "scout"},
    {"user": "root", "password": "0" * 64},
]
MODES = ("client", "peer", "router")
HANGS_UP_WITHIN_S = 20.0  # a process of a crowded machine may get to it late; only one that lets in stays silent


class Attacker:
    """One account and what it tries."""

    def __init__(self, given: dict[str, Any]) -> None:
        self.mission, self.creator, self.endpoints = given["mission"], given["creator"], given["endpoints"]
        self.folder, self.victim, self.pids = Path(given["folder"]), given["victim"], given["pids"]
        self.lines = given["lines"]
        self.only_client = given["uid"] == 0
        self.tried: Counter[str] = Counter()
        self.reached: Counter[str] = Counter()
        self.answers: dict[str, str] = {}

    def ask(self, session: zenoh.Session, source: str, address: str, question: Message) -> bytes | None:
        payload = write(Envelope(WIRE_VERSION, source, 1, 0.0, "", question))
        for reply in session.get(f"scout/{self.mission}/{address}/ask", payload=payload, timeout=5.0):
            return (reply.err.payload if reply.err is not None else reply.ok.payload).to_bytes()
        return None

    def drive_a_held_robot(self, session: zenoh.Session) -> bytes | None:
        raw = self.ask(session, "ui_console/x", "backbone/rc_manager", AskSchedule())
        if raw is None:
            return None
        schedule = Reader(Schedule | Refused).read(raw).body
        for rc in schedule.rcs:
            if rc.kind == "scout" and rc.holders:
                holder = rc.holders[0]
                order = Drive(9.0, -9.0).under(holder.arc, holder.epoch)
                return self.ask(session, f"resource_pool/{holder.arc}", f"resource_pool/{rc.rc}", order)
        return raw

    def lift_a_stop(self, session: zenoh.Session) -> bytes | None:
        raw = self.ask(session, "ui_console/x", "resource_pool/scout3", AskStop())
        if raw is None:
            return None
        stop = Reader(StopState | Refused).read(raw).body
        return self.ask(session, "ui_console/safety", "resource_pool/scout3", LiftStop(stop.number, "safety"))

    def stop_the_launcher(self, session: zenoh.Session) -> bytes | None:
        return self.ask(session, "ui_console/down-1", "backbone/launcher", Stop("told by an operator"))

    def spawn_any_class(self, session: zenoh.Session) -> bytes | None:
        order = Spawn(Subsystem.RESOURCE_POOL, "intruder", "scout", "antigravity:Intruder")
        return self.ask(session, PLACER, self.creator, order)

    def append_trace_lines(self, session: zenoh.Session) -> bytes | None:
        parameters = {"mission": self.mission, "trace": self.victim}
        path = "backbone.rc_manager.service:RcManager"
        order = Spawn(Subsystem.BACKBONE, "intruder", "rc_manager", path, parameters)
        return self.ask(session, PLACER, self.creator, order)

    def log_elsewhere(self, session: zenoh.Session) -> bytes | None:
        path = "resource_pool.rcs.video_frequency:VideoFrequency"
        name = f"../../../../..{self.victim}"
        order = Spawn(Subsystem.RESOURCE_POOL, name, "video_frequency", path, {"driver": "simulated"})
        return self.ask(session, PLACER, self.creator, order)

    def redirect_the_trace(self, session: zenoh.Session) -> bytes | None:
        return self.ask(session, "ui_console/x", "backbone/rc_manager", SetParameter("trace", self.victim))

    def allow_any_type(self, session: zenoh.Session) -> bytes | None:
        return self.ask(session, "ui_console/x", self.creator, SetParameter("types", []))

    @property
    def bus_attacks(self) -> list[Callable[[zenoh.Session], bytes | None]]:
        return [
            self.drive_a_held_robot,
            self.spawn_any_class,
            self.append_trace_lines,
            self.log_elsewhere,
            self.redirect_the_trace,
            self.allow_any_type,
            self.lift_a_stop,
            self.stop_the_launcher,
        ]

    def read_the_secret(self) -> None:
        (self.folder / "secret").read_bytes()

    def look_into_the_folder(self) -> None:
        os.listdir(self.folder)

    def reach_the_socket(self) -> None:
        with socket.socket(socket.AF_UNIX) as raw:
            raw.connect(str(self.folder / "hub.sock"))

    def keep_a_line(self) -> None:
        """Connect to a process; their names are known to all accounts. Who is let in is not hung up on."""
        name = random.choice(self.lines)
        if name not in Path("/proc/net/unix").read_text().split():
            raise ValueError(f"no process listens at {name}")
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as raw:
            raw.connect("\0" + name[1:])
            raw.settimeout(HANGS_UP_WITHIN_S)
            with suppress(TimeoutError):
                if raw.recv(1) == b"":
                    raise PermissionError

    def replace_the_socket(self) -> None:
        (self.folder / "hub.sock").unlink()

    def kill_a_process(self) -> None:
        os.kill(self.pids[0], signal.SIGKILL)

    @property
    def file_attacks(self) -> list[Callable[[], None]]:
        return [
            self.read_the_secret,
            self.look_into_the_folder,
            self.reach_the_socket,
            self.keep_a_line,
            self.replace_the_socket,
            self.kill_a_process,
        ]

    def ways_in(self) -> Iterator[tuple[str, str, dict[str, str]]]:
        modes = MODES[:1] if self.only_client else MODES
        guesses = GUESSES[:1] if self.only_client else GUESSES
        ways = list(itertools.product(self.endpoints, modes, guesses))
        rng = random.Random(1)
        while True:  # each kind of attack meets every way in
            yield rng.choice(ways)

    def open(self, endpoint: str, mode: str, guess: dict[str, str]) -> zenoh.Session | None:
        settings = {
            "mode": mode,
            "connect": {"endpoints": [endpoint], "timeout_ms": 0, "exit_on_failure": True},
            "listen": {"endpoints": []},
            "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}, "delay": 0},
            "transport": {"auth": {"usrpwd": guess}, "unicast": {"open_timeout": 2000}},
        }
        try:
            session = zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))
        except zenoh.ZError:
            return None
        if list(session.info.routers_zid()):
            return session
        session.close()
        return None

    def attack(self, attempts: int) -> None:
        ways = self.ways_in()
        attacks = itertools.cycle([*self.bus_attacks, *([] if self.only_client else self.file_attacks)])
        for attack in itertools.islice(attacks, attempts):
            name = attack.__name__
            self.tried[name] += 1
            if attack in self.file_attacks:
                with suppress(OSError):
                    attack()
                    self.reached[name] += 1
                continue
            session = self.open(*next(ways))
            if session is not None:
                with session:
                    self.reached[name] += 1
                    answer = attack(session)
                    self.answers[name] = "" if answer is None else answer.decode("latin-1")


def main() -> None:
    """Carry out the ordered attacks."""
    given = json.load(sys.stdin)
    os.setgroups([])
    os.setresgid(given["uid"], given["uid"], given["uid"])
    os.setresuid(given["uid"], given["uid"], given["uid"])
    attacker = Attacker(given)
    attacker.attack(given["attempts"])
    found = {"tried": attacker.tried, "reached": attacker.reached, "answers": attacker.answers}
    print(json.dumps({"uid": os.getuid(), **found}))


if __name__ == "__main__":
    main()
