"""A robot whose replies cannot be decoded is told once: else its readings stay as they were, and look well."""

from __future__ import annotations

from typing import Any

from pool_on_local_network import a_pool
from replying_pool import RADIO, RCS, SCOUT1, overhear

from backbone.bus.clock import run_virtual
from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from resource_pool.messages import Reply
from resource_pool.robot_reports import RIGHT_IN_A_ROW
from scout_model import radio_link


def test_replies_that_cannot_be_decoded_are_one_warning_and_one_notice_when_they_can(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, RCS) as pool:
            radio, told = pool.voice("radio"), overhear(pool, SCOUT1, Conversation.LOG, StoryEvent)
            good = radio_link.encode_reply(radio_link.ScoutReply(0.5, 0.1, 0.2))

            async def replies(*payloads: bytes) -> list[tuple[LogLevel, str]]:
                for payload in payloads:
                    radio.publish(RADIO, Conversation.REPLIES, Reply(1, payload))
                await pool.clock.sleep_s(0.1)
                return [(one.level, one.what.partition(":")[0]) for one in told]

            assert await replies(b"R", good, b"R", b"noise") == []
            wrong = (LogLevel.WARNING, "its replies cannot be decoded")
            assert await replies(b"R") == [wrong]
            assert await replies(*[b"R", b"R", b"R", good] * 10) == [wrong]
            assert await replies(*[good] * RIGHT_IN_A_ROW) == [
                wrong,
                (LogLevel.NOTICE, "its replies can be decoded again"),
            ]

    run_virtual(main())
