"""Facts that ``scout-backbone top`` shows of a key beside its rate: quality, drops, missed deadlines."""

from __future__ import annotations

import asyncio
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import msgspec

from backbone.addresses import NAMESERVER
from backbone.bus.interface import Bus, Reply
from backbone.component.messages import (
    DEADLINES_MISSED,
    MESSAGES_DROPPED,
    AskParameters,
    AskStatistics,
    Parameters,
    Statistics,
)
from backbone.errors import LinkError, Refusal
from backbone.keys import ROOT, Conversation
from backbone.mission.model import EXECUTION_UNIT
from backbone.nameserver.messages import Components, ListComponents
from backbone.quality import QUALITY, Quality
from backbone.recording.hearing import is_meant
from backbone.spoken import counted
from backbone.wire import Message

TrafficRow = dict[str, Any]
"""The traffic of one key, sender and schema, as plain data."""
REPLY_TIME_S = 1.0  # chosen: a hung component delays the answers of the others by no more


@dataclass(slots=True)
class KeyFacts:
    """Reports of a mission's components about their keys; keys are without ``scout/<mission>/``.

    Attributes:
        dropped: Key, or pattern of keys → messages that arrived for listeners but were dropped before delivery.
        missed: Key → number of deadlines that its listeners missed.
        declared: Key → quality, if it differs from the quality of its conversation.
        silent: Components that did not answer.
    """

    dropped: dict[str, int] = field(default_factory=dict)
    missed: dict[str, int] = field(default_factory=dict)
    declared: dict[str, Quality] = field(default_factory=dict)
    silent: list[str] = field(default_factory=list)

    def take_statistics(self, values: Mapping[str, float]) -> None:
        """Add the counts of one component."""
        for name, count in values.items():
            for begin, counts in ((MESSAGES_DROPPED, self.dropped), (DEADLINES_MISSED, self.missed)):
                if name.startswith(begin):
                    key = name.removeprefix(begin)
                    counts[key] = counts.get(key, 0) + int(count)

    def take_unit(self, address: str, parameters: Mapping[str, object]) -> None:
        """Add the qualities in which an execution unit publishes its outputs."""
        try:
            published = msgspec.convert(parameters.get("published", []), list[str])
            qualities = msgspec.convert(parameters.get("qualities", {}), dict[str, Quality])
        except msgspec.ValidationError:  # of another release
            return
        for key in qualities.keys() & set(published):
            self.declared[f"{address}/{key}/{Conversation.OUTPUTS}"] = qualities[key]

    def quality_of(self, key: str) -> Quality | None:
        """Return the quality of a key; None: no known conversation, or an output of a unit that did not answer."""
        address, conversation = "/".join(key.split("/")[:2]), key.rpartition("/")[2]
        if conversation == Conversation.OUTPUTS and address in self.silent:
            return None
        known = QUALITY[Conversation(conversation)] if conversation in set(Conversation) else None
        return self.declared.get(key, known)


def with_facts(
    rows: Sequence[TrafficRow], facts: KeyFacts, mission: str, patterns: Sequence[str] = ()
) -> list[TrafficRow]:
    """Return the rows with the facts of their keys, followed by a row for each other key that has a count.

    Args:
        patterns: Patterns of the selected keys; none: all keys.
    """
    keys = [one["key"].split("/", 2)[-1] for one in rows]
    counted_keys = dict.fromkeys([*facts.dropped, *facts.missed])
    others = [key for key in counted_keys if key not in keys and _is_meant(f"{ROOT}/{mission}/{key}", patterns)]
    idle = {"source": "", "schema": "", "messages_per_s": 0.0, "bytes_per_s": 0.0, "mean_bytes": 0.0}
    silent = [{"key": f"{ROOT}/{mission}/{key}", **idle} for key in others]
    return [
        {
            **row,
            "quality": str(facts.quality_of(key) or ""),
            "dropped": facts.dropped.get(key, 0),
            "deadlines_missed": facts.missed.get(key, 0),
        }
        for key, row in zip([*keys, *others], [*rows, *silent], strict=True)
    ]


def facts_text(row: TrafficRow) -> str:
    """Return the facts of a row in words.

    Example:
        >>> facts_text({"quality": "best effort, low", "dropped": 12, "deadlines_missed": 1})
        'best effort, low; 12 dropped; 1 deadline missed'
    """
    return "; ".join(_words(row))


def _words(row: TrafficRow) -> Iterator[str]:
    if row["quality"]:
        yield row["quality"]
    if row["dropped"]:
        yield f"{row['dropped']} dropped"
    if row["deadlines_missed"]:
        yield f"{counted(row['deadlines_missed'], 'deadline')} missed"


def _is_meant(key: str, patterns: Collection[str]) -> bool:
    return not patterns or is_meant(key, tuple(patterns))


async def ask_facts(bus: Bus) -> KeyFacts:
    """Return the present reports of all components, except those that do not answer in time."""
    facts = KeyFacts()
    found = await _asked(bus, NAMESERVER, ListComponents(), Components)
    components = found.components if found is not None else []

    async def ask(address: str, kind: str) -> None:
        statistics = await _asked(bus, address, AskStatistics(), Statistics)
        if statistics is None:
            facts.silent.append(address)
            return
        facts.take_statistics(statistics.values)
        if kind == EXECUTION_UNIT and (answer := await _asked(bus, address, AskParameters(), Parameters)) is not None:
            facts.take_unit(address, answer.values)

    await asyncio.gather(*(ask(one.address, one.type) for one in components))
    return facts


async def _asked(bus: Bus, address: str, question: Message, reply: type[Reply]) -> Reply | None:
    try:
        return await bus.ask(address, question, reply, within_s=REPLY_TIME_S)
    except (LinkError, Refusal):
        return None
