from casadi_hands.task import Task, describe_fields
from casadi_hands.task.structure import walk


def test_every_field_has_its_row() -> None:
    text = describe_fields()
    for path, field, _ in walk(Task):
        rows = [row for row in text.splitlines() if row.startswith(f"| `{path.split('.')[-1]}` |")]
        assert any(row.endswith(f"| {field.description} |") for row in rows), path


def test_defaults_and_places() -> None:
    text = describe_fields()
    assert "### `object.shapes[].capsule`" in text
    assert "### `fingers.<name>`" in text
    assert "### `palm.motion[]`" in text
    assert "| `slip` | 0.0002 |" in text
    assert "| `mass` | required | Mass, kg. |" in text
    assert "| `link_radius` | 0.13 × palm.radius; more where a straight finger would bend" in text
    assert "| `tip_target` | [50, 10, 50] |" in text
