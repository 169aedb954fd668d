"""The air of a mission file is the one the scout model knows: same names, same defaults, same limits."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from backbone.mission.declaration.vocabulary import vocabulary
from backbone.mission.reader import read_mission
from scout_model.description import AS_THE_PAPERS, AirDescription, WorldDescription

SMALL = Path(__file__).parent / "small.xml"
ROOM = '<room width-m="9" depth-m="6"/>'


def air_of(tmp_path: Path, element: str) -> AirDescription:
    text = SMALL.read_text()
    assert ROOM in text
    file = tmp_path / "m.xml"
    file.write_text(text.replace(ROOM, ROOM + element))
    [world] = read_mission(file).components
    return msgspec.convert(world.parameters["world"], WorldDescription).air


@pytest.mark.parametrize("element", ["", "<air/>"])
def test_without_anything_said_the_air_is_mild(tmp_path: Path, element: str) -> None:
    assert air_of(tmp_path, element) == AirDescription()


def test_one_number_makes_it_the_papers_air(tmp_path: Path) -> None:
    assert air_of(tmp_path, '<air noise="1"/>') == AS_THE_PAPERS


def test_everything_said_is_taken_over(tmp_path: Path) -> None:
    said = AirDescription(0.5, 0.1, 0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.9, 0.95, 0.05, 0.01, -1.0, 2.5, 2.0)
    words = " ".join(f'{name.replace("_", "-")}="{value}"' for name, value in msgspec.structs.asdict(said).items())
    assert air_of(tmp_path, f"<air {words}/>") == said


def test_the_schema_has_an_attribute_for_every_field_and_no_other() -> None:
    fields = [field.name for field in msgspec.structs.fields(AirDescription)]
    assert [name.replace("-", "_") for name in vocabulary()["air"].attributes] == fields


@pytest.mark.parametrize("field", [field.name for field in msgspec.structs.fields(AirDescription)])
def test_the_description_refuses_what_the_schema_refuses(field: str) -> None:
    for wrong in (-1001.0, 1001.0, float("nan")):
        with pytest.raises(msgspec.ValidationError):
            msgspec.convert({field: wrong}, AirDescription)
