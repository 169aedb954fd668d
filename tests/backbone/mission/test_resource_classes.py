"""Which classes a resource of a mission may have."""

from __future__ import annotations

from pathlib import Path

from mission_files import changed, faults_in, read_text


def test_a_resource_whose_class_is_no_resource_controller_is_refused(tmp_path: Path) -> None:
    lidar = '<type name="lidar" class="backbone.component.component:Component" subsystem="resource_pool"/>\n  </types>'
    text = changed(("  </types>", lidar), ("  </resources>", '<resource type="lidar" name="lidar1"/></resources>'))
    [fault] = faults_in(tmp_path, text)
    assert fault.message == (
        "type lidar is no resource: its class backbone.component.component:Component is no resource controller"
    )
    assert text.splitlines()[fault.line - 1][fault.column - 1 :].startswith('type="lidar"')


def test_a_new_kind_of_hardware_needs_no_other_schema(tmp_path: Path) -> None:
    base = "resource_pool.resource_controller:ResourceController"
    lidar = f'<type name="lidar" class="{base}" subsystem="resource_pool"/>\n  </types>'
    description = read_text(
        tmp_path,
        changed(
            ("  </types>", lidar),
            ('<needs type="scout"/>', '<needs type="scout"/><needs type="lidar"/>'),
            (
                "  </resources>",
                '<resource type="lidar" name="lidar1" driver="sick" features="long-range"/></resources>',
            ),
            ('minimum-runtime-s="5"/>', 'minimum-runtime-s="5"><wish type="lidar" features="long-range"/></arc>'),
        ),
    )
    assert description.resources[-1].features == ["long-range"]
    assert next(kind.needs for kind in description.types if kind.name == "drive") == {
        kind: kind for kind in ("scout", "lidar", "command_radio")
    }
    assert description.behaviors[1].arc is not None
    assert description.behaviors[1].arc.features == {"lidar": ("long-range",)}
