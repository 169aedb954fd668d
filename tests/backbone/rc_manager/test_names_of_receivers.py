"""Receivers make addresses from the ARC names in these messages, so a message with an illegal one is malformed."""

from __future__ import annotations

import pytest

from backbone.rc_manager.messages import Beat, Connect, RcState
from backbone.scheduling.requests import Holder, RcUse
from backbone.scheduling.views import RcView, Schedule
from backbone.wire import Envelope, MalformedMessage, Message, Reader, write

HOLDER = Holder("drive1", 3, 0.0, 2.0)


@pytest.mark.parametrize(
    "message",
    [
        Beat("drive1"),
        Connect("drive1", 3, 2.0, RcUse(), {}),
        RcState("scout1", "scout", False, 1.0, [HOLDER], 3, 0, 0),
        Schedule(0.0, [RcView("scout1", "scout", "up", False, 1.0, [HOLDER], 3, [])], [], []),
    ],
    ids=lambda message: type(message).__name__,
)
def test_an_illegal_name_of_an_arc_is_malformed(message: Message) -> None:
    raw, reader = write(Envelope(1, "backbone/rc_manager", 1, 0.0, "", message)), Reader(type(message))
    assert reader.read(raw).body == message
    with pytest.raises(MalformedMessage, match=r"a-z0-9_-"):
        reader.read(raw.replace(b"drive1", b"pool/1"))
