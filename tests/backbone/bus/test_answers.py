"""The outcome of a question, as its asker learns it."""

import pytest

from backbone.bus.answers import read_answer
from backbone.component.messages import Stop, Stopping
from backbone.wire import WIRE_VERSION, Envelope, MalformedMessage, write


def test_an_answer_of_another_release_has_the_remedy_for_it() -> None:
    came = write(Envelope(WIRE_VERSION + 1, "backbone/launcher", 1, 0.0, "", Stopping()))
    with pytest.raises(MalformedMessage, match=r"backbone/launcher answered Stop .*: envelope") as refused:
        read_answer(came, "backbone/launcher", Stop(), Stopping, within_s=1.0)
    assert "the same release" in refused.value.remedy
