"""The simulated radio: it hears its robots as long as it is open, also after a driver exchange brought it back."""

from __future__ import annotations

from types import SimpleNamespace

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.keys import Conversation
from resource_pool.drivers.interface import DriverSite
from resource_pool.drivers.simulated import SimulatedRadio
from resource_pool.drivers.world_messages import ReplyOnAir

RADIO = "resource_pool/radio"


def test_a_radio_that_comes_back_hears_its_robots_again() -> None:
    async def scene() -> None:
        network, clock = LocalNetwork(), VirtualClock()
        own, world = network.join(RADIO, clock), network.join("resource_pool/world", clock)
        parameters = SimpleNamespace(world="world", options={})
        radio = SimulatedRadio(DriverSite("radio", own, clock, parameters, lambda what: None, lambda bug: None))
        heard = list[bytes]()
        for reply in (b"first", b"second"):
            await radio.open()
            radio.hear(1, heard.append)
            world.publish(RADIO, Conversation.COMMAND, ReplyOnAir("radio", 1, reply, 0))
            await clock.sleep_s(0.1)
            assert heard[-1:] == [reply]
            await radio.close()
            world.publish(RADIO, Conversation.COMMAND, ReplyOnAir("radio", 1, b"while closed", 0))
            await clock.sleep_s(0.1)
        assert heard == [b"first", b"second"]
        await own.close()
        await world.close()

    run_virtual(scene())
