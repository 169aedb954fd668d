"""The nameserver: runs the mission's hub, registers components and resolves their names.

It starts first (RAM 2002, "Backbone": all components find each other through it). All links end at its process, so it
detects every death within milliseconds.

The first hub of a mission has no predecessor whose components could reconnect, so its lists are complete at once and
the bring-up need not wait. It writes a file into the run directory, from which the next hub learns that it is not the
first. A second file keeps the emergency stops: if a stopped robot's RC and the hub end together, the robot's next RC
still learns of its stop from the next hub.
"""

from __future__ import annotations

import asyncio
import logging
from pathlib import Path
from typing import assert_never

import msgspec

from backbone.authentication import SOCKET, NoSecret, dictionary_of
from backbone.bus.interface import Bus, Clock
from backbone.bus.zenoh_bus import ZenohBus, hub_config
from backbone.bus.zenoh_threads import threads_of_a_hub
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component.messages import AskState, ComponentState, LogLevel, NameTaken, Register, Registered
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.nameserver.messages import (
    RECONNECT_S,
    Appeared,
    Disappeared,
    ListComponents,
    NameserverQuestion,
    Resolve,
    Resolved,
)
from backbone.nameserver.registry import CLAIM_WITHIN_S, Announce, Instruction, Introduce, Registry
from backbone.nameserver.stops_file import UNREADABLE, StopsFile
from backbone.naming import IllegalName, component_of, is_component, read_claim
from backbone.operating_system.lingering import ignore_lingering
from backbone.operating_system.own_process import most_files
from backbone.operating_system.processes import open_files
from backbone.wire import Envelope, Message

log = logging.getLogger(__name__)

HUB_BEGAN = "hub-began"
INTRODUCE_EACH_S = 1.0  # chosen: a component that does not answer in this time hangs; then only its token is known
SPARE_FILES = 48  # chosen: sixteen further processes; a hub opens three files for each


class NameserverParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Parameters of the nameserver.

    Attributes:
        listen: Endpoints at which the hub listens for other machines, besides the launch's own.
    """

    listen: list[str] = []


class FixedEndpoints(Refusal):
    """The endpoints of a running hub cannot be changed."""

    code = "nameserver.fixed_endpoints"
    remedy = "Change address or port of the first host in the mission file, and bring the mission up again."


class Nameserver(Component[NameserverParameters]):
    """Registers components by name and publishes their appearance and disappearance."""

    parameters_type = NameserverParameters
    accepts = NameserverQuestion
    registers = False

    @classmethod
    def open_bus(cls, launch: Launch, clock: Clock) -> Bus:
        """Return the bus of the hub itself, which listens at the launch's endpoint and for other machines.

        Raises:
            NoSecret: The hub would listen for other machines without authentication.
        """
        listen = [str(endpoint) for endpoint in launch.parameters.get("listen", [])]
        dictionary_file = dictionary_of(launch.run_directory)
        if listen and not dictionary_file:
            raise NoSecret(f"the hub would listen at {', '.join(listen)} without a secret")
        config = hub_config([launch.endpoint, *listen], dictionary_file=dictionary_file)
        threads_of_a_hub()
        if any(not endpoint.startswith(SOCKET) for endpoint in (launch.endpoint, *listen)):
            ignore_lingering()
        bus = ZenohBus.open(launch.mission, launch.address, clock, config)
        bus.use_host(launch.run_directory)
        return bus

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        reconnect_s = 0.0 if _is_first(launch) else RECONNECT_S * clock.rate
        self._stops_file = StopsFile(launch.run_directory)
        stops = self._stops_file.read()
        otherwise = UNREADABLE if stops is None else None
        self._registry = Registry(clock.now_s(), reconnect_s, CLAIM_WITHIN_S * clock.rate, stops, otherwise)
        self._to_introduce: asyncio.Queue[str] = asyncio.Queue()
        self._lacks_files = False
        self._registrations = self._refusals = self._appeared = self._disappeared = self._unanswered = 0

    async def connect(self) -> None:
        """Register itself and watch every token from the first one on."""
        self._registry.registered(self.component_state(), self.clock.now_s())
        self._registry.claim_changed(self.address, self.component_state().incarnation, stands=True)
        self.bus.watch_alive("*/*/*", self._claim_changed)
        self.bus.watch_alive("*/*", self._token_changed)
        self.bus.subscribe("*/*", Conversation.STATUS, ComponentState, self._status_published)

    def parameters_changed(self) -> None:
        """Refuse: an open hub does not change its endpoints.

        Raises:
            FixedEndpoints: Always.
        """
        raise FixedEndpoints(
            f"{self.name} listens at {self.launch.endpoint} and {self.launch.parameters.get('listen', [])}"
        )

    async def serve(self) -> None:
        """Ask the components of unknown tokens for their states."""
        while True:
            address = await self._to_introduce.get()
            self.start_task(self._introduce(address), f"introduce {address}")

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer ``Register``, ``Resolve`` and ``ListComponents``."""
        match asked.body:
            case Register(component=component):
                return self._give_name(component)
            case Resolve(name=name):
                return Resolved(self._registry.resolve(name, self.clock.now_s()))
            case ListComponents(subsystem=subsystem, type=component_type):
                return self._registry.components(subsystem, component_type, self.clock.now_s())
        return await super().answer(asked)

    def statistics(self) -> dict[str, float]:
        """Return counts of registered components, and of events since the hub's start."""
        return {
            "components": float(sum(1 for _ in self._registry.states())),
            "registrations": float(self._registrations),
            "names_refused": float(self._refusals),
            "appeared": float(self._appeared),
            "disappeared": float(self._disappeared),
            "introductions_unanswered": float(self._unanswered),
        }

    def _give_name(self, component: ComponentState) -> Registered:
        name = component_of(component.address)
        try:
            self._registry.registered(component, self.clock.now_s())
        except NameTaken as taken:
            self._refusals += 1
            self.story.note(name, f"refused to {component.host} pid {component.pid}: {taken.detail}")
            raise
        self._registrations += 1
        self.story.note(name, f"registered as {component.address} on {component.host}, pid {component.pid}")
        if self.launch.endpoint:  # else it shares the process of its mission, without a hub
            self._say_if_files_run_out()
        return Registered(self._registry.last_stop(name))

    def _say_if_files_run_out(self) -> None:
        most = most_files()
        try:
            used = open_files()
        except OSError:
            used = most
        lacked, self._lacks_files = self._lacks_files, used > most - SPARE_FILES
        if self._lacks_files and not lacked:
            danger = f"has {used} of {most} files open: soon no further process can connect"
            self.publish_event(self.name, f"{danger}; raise the limit of open files", LogLevel.ALARM)

    def _claim_changed(self, claim: str, stands: bool) -> None:
        try:
            address, holder = read_claim(claim)
        except IllegalName as illegal:  # a token of an unknown client must not end the hub
            self.story.note(claim, f"ignored: {illegal.detail}")
            return
        self._registry.claim_changed(address, holder, stands=stands)

    def _token_changed(self, address: str, stands: bool) -> None:
        if not is_component(address):  # of an unknown client: no component would ever answer there
            self.story.note(address, "ignored: no component can have this address")
            return
        self._carry_out(self._registry.token_changed(address, stands=stands, now_s=self.clock.now_s()))

    def _status_published(self, heard: Envelope[ComponentState]) -> None:
        self._registry.status_published(heard.body)
        self._keep_stops()

    def _keep_stops(self) -> None:
        """Save the stops for the next hub; a write error ends no hub."""
        try:
            self._stops_file.keep(self._registry.last_stops())
        except OSError as error:
            lost = f"a restart of the hub will not know which robots are stopped: {error.strerror}"
            self.publish_event(self.name, lost, LogLevel.WARNING)

    def _carry_out(self, instructions: list[Instruction]) -> None:
        for instruction in instructions:
            match instruction:
                case Announce(news=news):
                    self._announce(news)
                case Introduce(address=address):
                    self._to_introduce.put_nowait(address)
                case _:
                    assert_never(instruction)

    def _announce(self, news: Appeared | Disappeared) -> None:
        match news:
            case Appeared(component=component):
                self._appeared += 1
                name = component_of(component.address)
                self.story.note(name, f"appeared on {component.host}, pid {component.pid}")
            case Disappeared(address=address):
                self._disappeared += 1
                self.story.note(component_of(address), "disappeared")
            case _:
                assert_never(news)
        self.bus.publish(self.address, Conversation.EVENTS, news)

    async def _introduce(self, address: str) -> None:
        """Ask the component of a token for its state, until it answers or the token ends."""
        while True:
            try:
                state = await self.bus.ask(address, AskState(), ComponentState, within_s=INTRODUCE_EACH_S)
            except LinkError as error:
                self._unanswered += 1
                self.story.note(component_of(address), f"did not introduce itself: {error}")
            except Refusal as refusal:  # a token without a component: asking again is useless
                self._registry.introduction_failed(address)
                self.story.note(component_of(address), f"refused to introduce itself: {refusal.detail}")
                return
            else:
                self._carry_out(self._registry.introduced(state))
                self._keep_stops()
                return
            self._registry.introduction_failed(address)
            if not self._registry.is_unknown(address):
                return
            await self.clock.sleep_s(INTRODUCE_EACH_S * self.clock.rate)


def _is_first(launch: Launch) -> bool:
    """Return whether this is the mission's first hub; without the file of the first hub it may be another."""
    if not launch.run_directory:
        return False
    directory = Path(launch.run_directory)
    try:
        directory.mkdir(mode=0o700, parents=True, exist_ok=True)
        (directory / HUB_BEGAN).touch(exist_ok=False)
    except FileExistsError:
        return False
    except OSError as error:
        log.warning("cannot write the file of the first hub: %s; waiting for components as after a restart", error)
        return False
    return True
