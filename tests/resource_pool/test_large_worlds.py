"""The model of a large world travels to those who draw it."""

from backbone.wire import WIRE_VERSION, Envelope, Reader, write
from resource_pool.drivers.world_messages import WorldModel
from scout_model.composition import compose
from scout_model.description import RobotPlace, WorldDescription


def test_the_model_of_150_scouts_fits_into_its_message() -> None:
    robots = [
        RobotPlace(f"scout{number}", number, number % 10 + 1.0, number / 10 + 1.0, 0.0) for number in range(1, 151)
    ]
    model = WorldModel(compose(WorldDescription(20.0, 20.0, robots=robots)), {})
    written = write(Envelope(WIRE_VERSION, "resource_pool/world", 1, 0.0, "", model))
    assert Reader(WorldModel).read(written).body == model
