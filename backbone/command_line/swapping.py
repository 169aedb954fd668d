"""The work of ``scout-backbone swap``: a person exchanges a class, and the mission's log names the person."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Collection, Iterable
from uuid import uuid4

import msgspec

from backbone.addresses import NAMESERVER, PLACER
from backbone.bus.interface import Bus, Clock
from backbone.command_line.connection import REPLY_TIME_S, connected
from backbone.command_line.unit_modules import modules_by_unit
from backbone.command_line.where import Where
from backbone.command_line.wrong_words import WrongUsage
from backbone.component.asking import ask_until_answered
from backbone.component.messages import Absence, AskState, AskTime, ComponentState, MissionTime
from backbone.creator.messages import creator_name
from backbone.errors import LinkError, NoResponder, OutcomeUnknown, Refusal
from backbone.exchange import NotExchanged, Silent, SwapClass, SwapModule, Swapped, UnknownExchange, UnknownModule
from backbone.launcher.endings import ExitCode, say, show
from backbone.mission.model import EXECUTION_UNIT
from backbone.mission_log.operators import OperatorAction, publish_action
from backbone.nameserver.messages import Components, ListComponents, Resolve, Resolved
from backbone.naming import Subsystem, address, component_of, did_you_mean
from backbone.picture.reasons import stopped_unit
from backbone.placer.messages import ListPlacements, Placements
from backbone.spoken import counted
from backbone.wire import UnknownMessage

AGAIN_WITHIN_S = 20.0  # chosen: a hub that hangs is replaced within 4 s, and a process within its restart delays
READ_WITHIN_S = 60.0  # chosen: an import of a large library on a busy machine, and the answer


async def swap_class(where: Where, asked: SwapModule) -> ExitCode:
    """Exchange the module, the behavior's class or the resource's driver of this name, and print which one is in use.

    Raises:
        WrongUsage: The class of a module or behavior is only a name.
        UnknownModule: Nothing of the mission that can be exchanged has this name.
        Silent: The component of this name does not answer; nothing was changed.
        Refusal: The new one cannot take the place; nothing was changed.
        OutcomeUnknown: It did not answer.
    """
    async with connected(where) as (bus, clock):
        at, question = await addressed(bus, asked)
        publish_action(bus, clock, OperatorAction.SWAP, asked.module, f"for {asked.class_path}")
        within_s = (asked.ready_within_s + asked.prove_s) / clock.rate + READ_WITHIN_S
        try:
            swapped = await swapped_by(bus, clock, at, question, within_s)
        except UnknownMessage:
            raise NotExchanged(
                f"{asked.module} is no module, behavior or resource", remedy="See 'scout-backbone status' for these."
            ) from None
        except asyncio.CancelledError:
            say(f"the exchange goes on without this command; 'scout-backbone log --text {asked.module}' shows its end")
            raise
        except (LinkError, UnknownExchange) as error:
            cause = error.detail if isinstance(error, Refusal) else error
            told = f"{component_of(at)} ended, hung or was cut off while it exchanged {asked.module}: {cause}"
            raise OutcomeUnknown(told, remedy=f"See 'scout-backbone why {component_of(at)}', and 'log'.") from error
    counts = "round" if question is asked else "command" if at.startswith(f"{Subsystem.MISSION_CONTROL}/") else "call"
    show([result_line(asked, swapped, counts)])
    if swapped.remark:
        say(swapped.remark)
    return ExitCode.DONE if swapped.is_proved else ExitCode.REFUSED


async def swapped_by(bus: Bus, clock: Clock, at: str, question: SwapModule | SwapClass, within_s: float) -> Swapped:
    """Return the answer; if the link breaks before it arrives, ask for it again.

    Raises:
        Refusal: It refused; if the class cannot be imported there, the detail names the host.
        UnknownExchange: The component was started again meanwhile.
        LinkError: It does not answer.
    """
    question = msgspec.structs.replace(question, exchange_id=uuid4().hex)
    try:
        return await bus.ask(at, question, Swapped, within_s=within_s)
    except NoResponder as broken:
        say(f"waiting for {component_of(at)}, which ended or was cut off: {broken}")
        again = msgspec.structs.replace(question, is_repeated=True)
        return await ask_until_answered(bus, clock, at, again, Swapped, each_s=within_s, within_s=AGAIN_WITHIN_S)
    except Refusal as refusal:
        if "class_path" in refusal.facts:
            with contextlib.suppress(LinkError, Refusal):
                there = await bus.ask(NAMESERVER, Resolve(component_of(at)), Resolved, within_s=REPLY_TIME_S)
                refusal.detail = f"on host {there.component.host}: {refusal.detail}"
        raise


def result_line(asked: SwapModule, swapped: Swapped, counts: str) -> str:
    """Return the result for people; a new part that did nothing in its whole trial is not called proved.

    Args:
        counts: The unit of work of such a part: round, command or call.
    """
    state = "with the state of the old one" if swapped.keeps_state else "from a fresh state"
    times = f"{swapped.warming_s:.2f} s beside the old one"
    if swapped.proving_s or swapped.is_proved:
        times += f", {swapped.proving_s:.2f} s and {counted(swapped.rounds, counts)} to prove itself"
    if swapped.is_proved:
        after = f"; {swapped.cause}" if swapped.cause else ""
        is_tried = swapped.rounds or swapped.proving_s < asked.prove_s  # the end of its trial has another reason
        result = "proved" if is_tried else "not proved yet"
        return f"{asked.module}: {result}, {asked.class_path} goes on {state} ({times}){after}"
    return f"{asked.module}: returned, the old one goes on ({times}): {swapped.cause}"


async def addressed(bus: Bus, asked: SwapModule) -> tuple[str, SwapModule | SwapClass]:
    """Return the address to ask for the exchange, and the question.

    Raises:
        WrongUsage: The class of a module or behavior is only a name, as a built-in driver has.
        UnknownModule: Nothing of the mission that can be exchanged has this name.
        Silent: The component of this name, or a unit that may run it, does not answer or is not up.
    """
    listed = await bus.ask(NAMESERVER, ListComponents(), Components, within_s=REPLY_TIME_S)
    hosts = {one.address: one.host for one in listed.components}
    units = [one.address for one in listed.components if one.type == EXECUTION_UNIT]
    told = await modules_by_unit(bus, units)
    at = {str(one["name"]): unit for unit, modules in told.items() for one in modules or ()}
    silent = [unit for unit, modules in told.items() if modules is None]
    if asked.module in at:
        _check_class_path(asked)
        return at[asked.module], asked
    others = {component_of(one.address): one.address for one in listed.components if _may_be_exchanged(one)}
    if asked.module in others:
        part = others[asked.module]
        if not part.startswith(f"{Subsystem.RESOURCE_POOL}/"):
            _check_class_path(asked)
        try:
            await bus.ask(part, AskState(), ComponentState, within_s=REPLY_TIME_S)
        except LinkError as error:
            raise await _silent(bus, f"{asked.module} does not answer: {error}", {hosts[part]}) from None
        times = asked.prove_s, asked.ready_within_s
        return part, SwapClass(asked.class_path, asked.parameters, *times, asked.user)
    if silent:
        names = ", ".join(map(component_of, silent))
        may_run_it = f"{asked.module} is not known: {names} does not answer and may run it"
        raise await _silent(bus, may_run_it, {hosts[unit] for unit in silent})
    raise await _unknown(bus, asked.module, {*at, *others}, {component_of(one) for one in hosts})


def _check_class_path(asked: SwapModule) -> None:
    if ":" not in asked.class_path:
        told = f"{asked.class_path!r} is no class, and only drivers have names; write package.module:Class"
        raise WrongUsage(told, remedy="See 'scout-backbone swap --help'.")


def _may_be_exchanged(one: ComponentState) -> bool:
    pools = (f"{Subsystem.MISSION_CONTROL}/", f"{Subsystem.RESOURCE_POOL}/")
    return one.address.startswith(pools) and one.type != EXECUTION_UNIT


async def _silent(bus: Bus, told: str, hosts: Collection[str]) -> Silent:
    """Return the refusal for a component that does not answer; it names the hosts that do not answer either."""

    async def is_out_of_reach(host: str) -> bool:
        try:
            await bus.ask(
                address(Subsystem.BACKBONE, creator_name(host)), AskTime(), MissionTime, within_s=REPLY_TIME_S
            )
        except LinkError:
            return True
        return False

    away = ", ".join([host for host in sorted(hosts) if await is_out_of_reach(host)])
    if not away:
        return Silent(told)
    return Silent(
        f"{told}; nor does the creator of {away}, so that host cannot be reached",
        remedy=f"Check the link to {away}, then swap again.",
    )


async def _unknown(bus: Bus, name: str, known: Iterable[str], up: Collection[str]) -> Refusal:
    """Return the refusal that explains why no part of this name can be exchanged."""
    try:
        placed = await bus.ask(PLACER, ListPlacements(), Placements, within_s=REPLY_TIME_S)
    except LinkError:
        placed = Placements([])
    if name in placed.stopped:
        remedy = "Start it through its owner or by 'scout-backbone start', then swap again."
        return Silent(f"{name} is stopped: {placed.stopped[name]}", remedy=remedy)
    if told := await stopped_unit(bus, name, placed.stopped):
        return Silent(told, remedy="Start it, then swap again.")
    absent = {one.name: one.type for one in placed.placements if one.name not in up}
    if name in absent:
        return await _not_up(bus, f"{name} is not up", [name])
    if units := [one for one, kind in absent.items() if kind == EXECUTION_UNIT]:
        return await _not_up(bus, f"{name} is not known: {', '.join(units)} is not up and may run it", units)
    return UnknownModule(f"no module, behavior or resource {name!r} runs{did_you_mean(name, known)}")


async def _not_up(bus: Bus, told: str, names: list[str]) -> Silent:
    """Return the refusal for components that are not up, with the placer's reason."""
    try:
        absent = (await bus.ask(PLACER, AskState(), ComponentState, within_s=REPLY_TIME_S)).absent
    except LinkError:
        absent = list[Absence]()
    mine = [one for one in absent if one.name in names]
    why = "".join(f"; {one.name} {one.cause}" for one in mine)
    remedies = dict.fromkeys(
        f"{one.remedy[:1].upper()}{one.remedy[1:]}; then swap again." for one in mine if one.remedy
    )
    return Silent(told + why, remedy=" ".join(remedies) or _NOT_UP)


_NOT_UP = "Wait until its creator has started it again ('scout-backbone status'), then swap again."
