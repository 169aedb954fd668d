"""Numbers of a developer's driver or RC that are none: the RC refuses or reports them, and goes on."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import pytest
from pool_on_local_network import HandOperatedGrabber, a_pool
from pool_orders import at, command, connect, connect_robot

from backbone.bus.clock import run_virtual
from backbone.component.messages import LogLevel
from backbone.keys import Conversation
from backbone.wire import Envelope
from resource_pool.arc_client import stop_robot
from resource_pool.commands import Drive, Tune
from resource_pool.drivers.interface import HardwareFault
from resource_pool.drivers.simulated import SimulatedScoutProtocol
from resource_pool.messages import Applied, Frame
from resource_pool.rcs.scout import Scout

HERE = "test_wrong_numbers_of_drivers"
NO_NUMBERS = {
    "nan": math.nan,
    "infinite": math.inf,
    "None": None,
    "a text": "15",
    "many digits": 10**400,
    "a list": [15.0],
}


class WrongPaceGrabber(HandOperatedGrabber):
    """Reports an impossible limit of its picture rate."""

    limit: ClassVar[Any] = None

    def allowed_hz(self) -> Any:
        return self.limit


class WrongLimits(SimulatedScoutProtocol):
    """Clips to something that is no speed."""

    speed: ClassVar[Any] = None

    def clip_wheel_speed(self, speed_rad_s: float) -> Any:
        return self.speed if speed_rad_s else 0.0


class WrongMotion(Scout):
    """Computes a motion that is no number."""

    motion: ClassVar[Any] = None

    def motion_of(self, values: Any) -> Any:
        return {"forward_m_s": self.motion, "turn_rad_s": 0.5}


@pytest.mark.parametrize("wrong", [*NO_NUMBERS.values(), -1.0], ids=[*NO_NUMBERS, "negative"])
def test_a_grabber_with_an_impossible_rate_is_reported_once_and_delivers_as_the_mission_file_asks(
    local_mission: Any, monkeypatch: pytest.MonkeyPatch, wrong: Any
) -> None:
    monkeypatch.setattr(WrongPaceGrabber, "limit", wrong)

    async def main() -> None:
        async with a_pool(local_mission, [], manager=False) as pool:
            grabber = await pool.rc("grabber", driver=f"{HERE}:WrongPaceGrabber")
            frames: list[Frame] = []
            pool.ear.subscribe("resource_pool/*", Conversation.FRAMES, Frame, lambda one: frames.append(one.body))
            await connect(pool, "grabber", "one", 1, lease_s=60.0)
            await pool.voice("one").ask(at("grabber"), Tune("video").under("one", 1), Applied, within_s=1)
            await pool.clock.sleep_s(20.0)
            assert grabber.statistics()["pictures_allowed_hz"] == grabber.parameters.frame_rate_hz
            assert grabber.absences(), "a device that delivers nothing is reported, whatever rate it allows"
            pool.grabber_driver.deliver(pool.grabber_driver.picture())
            await pool.clock.sleep_s(0.1)
            assert len(frames) == 1
            [warning] = [one for one in grabber.story.of("grabber") if "allows" in one.what]
            assert warning.level is LogLevel.WARNING
            assert "driver of grabber" in warning.what

    run_virtual(main())


@pytest.mark.parametrize("wrong", NO_NUMBERS.values(), ids=NO_NUMBERS)
def test_a_speed_that_is_no_number_is_refused_and_the_robot_obeys_its_next_commands(
    local_mission: Any, monkeypatch: pytest.MonkeyPatch, wrong: Any
) -> None:
    monkeypatch.setattr(WrongLimits, "speed", wrong)

    async def main() -> None:
        async with a_pool(local_mission, ["radio"], manager=False) as pool:
            await pool.rc("scout1", protocol=f"{HERE}:WrongLimits")
            await connect_robot(pool, "one", 1)
            with pytest.raises(HardwareFault, match="clip_wheel_speed of the robot's protocol returns"):
                await command(pool, "one", 1, Drive(4.0, 4.0))
            assert (await command(pool, "one", 1, Drive(0.0, 0.0))).values == {"left_rad_s": 0.0, "right_rad_s": 0.0}
            assert (await stop_robot(pool.voice_of("ui_console/console-1"), "scout1", "")).is_confirmed

    run_virtual(main())


@pytest.mark.parametrize("wrong", [math.nan, math.inf], ids=["nan", "infinite"])
def test_a_motion_that_is_no_number_is_not_published(
    local_mission: Any, monkeypatch: pytest.MonkeyPatch, wrong: float
) -> None:
    """Otherwise a localizer decodes none of the robot's commands."""
    monkeypatch.setattr(WrongMotion, "motion", wrong)

    async def main() -> None:
        async with a_pool(local_mission, ["radio"], manager=False, rc_classes={"scout": WrongMotion}) as pool:
            await pool.rc("scout1")
            motions: list[Envelope[Applied]] = []
            pool.ear.subscribe(at("scout1"), Conversation.MOTIONS, Applied, motions.append)
            await connect_robot(pool, "one", 1)
            await command(pool, "one", 1, Drive(4.0, 4.0))
            await pool.clock.sleep_s(0.1)
            assert motions[0].body.values == {"left_rad_s": 4.0, "right_rad_s": 4.0, "turn_rad_s": 0.5}

    run_virtual(main())


@pytest.mark.parametrize("wrong", [None, {"forward_m_s": "fast"}, {1: 2.0}, {"x" * 300: 1.0}], ids=repr)
def test_a_motion_of_wrong_form_ends_the_rc_with_the_name_of_the_method(
    local_mission: Any, monkeypatch: pytest.MonkeyPatch, wrong: Any
) -> None:
    def motion_of(_self: WrongMotion, _values: Any) -> Any:
        return wrong

    motion_of.__qualname__ = "WrongMotion.motion_of"
    monkeypatch.setattr(WrongMotion, "motion_of", motion_of)

    async def main() -> None:
        async with a_pool(local_mission, ["radio"], manager=False, rc_classes={"scout": WrongMotion}) as pool:
            await pool.rc("scout1")
            await connect_robot(pool, "one", 1)
            with pytest.raises(Exception, match="scout1"):
                await command(pool, "one", 1, Drive(4.0, 4.0))
            bug = await pool.outcome("scout1")
            assert isinstance(bug, TypeError)
            assert str(bug).startswith(f"{__name__}:WrongMotion.motion_of returned")

    run_virtual(main())
