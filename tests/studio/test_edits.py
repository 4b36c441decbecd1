"""A task is made and changed by what gizmos and fields do, and its file says just that."""

from __future__ import annotations

import difflib
import os
import stat

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.errors import TaskError
from casadi_hands.studio.document import shown_at, typed, value_at, with_field, with_value, without
from casadi_hands.studio.drawing import names_of
from casadi_hands.studio.fields import form_of
from casadi_hands.studio.places import moved, places, removed, with_finger, with_goal
from casadi_hands.studio.session import Session
from casadi_hands.task import describe_fields, load_task, parse_task
from casadi_hands.task.starter import Idea, starter
from tests.documents import ROOT
from tests.studio.example import CAPSULE

FILES = sorted((ROOT / "problems").glob("*.yaml"))
KINDS = [file for file in FILES if file.stem in ("draw_box", "pencil_pick_up", "sphere_rotation", "vertical_flip")]


def session(tmp_path, text=CAPSULE):
    path = tmp_path / "task.yaml"
    path.write_text(text, encoding="utf-8")
    return Session(path)


def place(session, name):
    return next(each for each in places(session.last.written) if each.name == name)


def drag(session, name, by=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0)):
    """What a gizmo does: moves by (3,), m, and turns by a rotation vector (3,), deg, both in the world."""
    each = place(session, name)
    rotation = Rotation.from_rotvec(turn, degrees=True).as_matrix() @ each.rotation
    session.edit(lambda text: moved(text, session.last.written, each, each.position + by, rotation))


def changed_lines(before, after):
    return [line for line in difflib.ndiff(before.splitlines(), after.splitlines()) if line[0] in "+-"]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_what_is_moved_nowhere_is_not_written_anew(file):
    edited = Session(file)
    assert not edited.unsaved
    assert with_value(edited.text, ("friction",), 0.123) != edited.text
    for each in places(edited.last.written):
        assert moved(edited.text, edited.last.written, each, each.position, each.rotation) == edited.text


@pytest.mark.parametrize("file", KINDS, ids=lambda file: file.stem)
def test_things_are_where_they_were_dragged(file, rng, tmp_path):
    for name in [each.name for each in places(Session(file).last.written)]:
        edited = Session(file)
        before = {each.name: each for each in places(edited.last.written)}
        by, turn = rng.uniform(-0.01, 0.01, 3), rng.uniform(-60, 60, 3)
        drag(edited, name, by, turn)
        after = {each.name: each for each in places(edited.last.written)}
        assert after[name].position == pytest.approx(before[name].position + by, abs=2e-5)
        if before[name].turns:
            wanted = Rotation.from_rotvec(turn, degrees=True).as_matrix() @ before[name].rotation
            got = Rotation.from_matrix(after[name].rotation @ wanted.T).magnitude()
            # A waypoint of the palm says where it faces, not how it rolls.
            facing = np.arccos(min(1.0, float(after[name].rotation[:, 2] @ wanted[:, 2])))
            assert np.degrees(facing if before[name].kind == "waypoint" else got) < 0.5
        # Nothing else has moved, but for what rides on the object, and palms that continue a turn.
        rides = ("contact",) if name.endswith("start") else ("waypoint",) if name == "palm" else ()
        for other in before.keys() - {name}:
            if before[other].kind not in rides:
                assert after[other].position == pytest.approx(before[other].position, abs=1e-12)


def test_one_edit_changes_one_line_and_no_comment():
    text = (ROOT / "problems/horizontal_translation.yaml").read_text(encoding="utf-8")
    after = with_value(text, ("friction",), typed("0.7"))
    assert changed_lines(text, after) == ["- friction: 0.6", "+ friction: 0.7"]
    after = with_value(text, ("hand", "axes", "from_link"), typed("[0, 90]"))
    assert changed_lines(text, after) == ["+ hand:", "+   axes:", "+     from_link: [0, 90]"]
    assert without(after, ("hand", "axes", "from_link")) == text


def test_lists_under_their_name_stay_there():
    text = "motion:\n- {at: 0}\n- {at: 1} # late\nfriction: 1\n"
    assert with_value(text, ("motion", 1, "at"), 2) == text.replace("at: 1", "at: 2")


def test_turns_go_on_past_half_a_turn(tmp_path):
    edited = session(tmp_path)
    for _ in range(5):
        drag(edited, "object, goal 1 at 1 s", turn=(0, 0, 50))
    assert value_at(edited.text, ("motion", 1, "rotation")) == {"axis": [0, 0, 1], "degrees": 250}
    for _ in range(5):
        drag(edited, "object, goal 1 at 1 s", turn=(0, 0, -50))
    assert edited.text == CAPSULE


def test_a_new_task_is_the_one_that_the_command_new_writes(tmp_path):
    edited = Session(tmp_path / "my lid.yaml")
    assert edited.text == starter(Idea("my lid"))
    assert edited.unsaved
    assert edited.understood.solvable
    assert edited.understood.doubts == edited.understood.questions == ()
    edited.save()
    assert load_task(edited.path).name == "my lid"


def test_a_task_from_nothing_is_the_task_that_a_person_would_write(tmp_path):
    edited = Session(tmp_path / "ball.yaml")
    edited.edit(lambda _: CAPSULE)
    fields = {
        ("name",): "turn a ball",
        ("object", "mass"): "0.05",
        ("object", "shapes"): "[sphere: {center: [0, 0, 0], radius: 0.03}]",
        ("friction",): "0.8",
        ("hand", "link_radius"): "0.006",
        ("motion", 1, "at"): "2",
    }
    for path, words in fields.items():
        edited.edit(lambda text, path=path, words=words: with_field(text, path, words))
    drag(edited, "contact thumb", by=(0, 0.01, 0))
    drag(edited, "contact index", by=(0.015, -0.00598, -0.025))
    drag(edited, "contact middle", by=(-0.015, -0.00598, 0.025))
    drag(edited, "palm", by=(0.09, 0, -0.1), turn=(0, -90, 0))
    drag(edited, "object, goal 1 at 2 s", by=(0, -0.02, 0.01), turn=(0, 0, 30))
    edited.edit(lambda text: with_goal(text, edited.last.written))
    drag(edited, "object, goal 2 at 3 s", by=(0, 0, -0.01), turn=(0, 0, -30))
    edited.save()
    expected = """
name: turn a ball
object: {mass: 0.05, shapes: [sphere: {center: [0, 0, 0], radius: 0.03}]}
palm: {radius: 0.06, position: [0.09, 0, 0.2], facing: [0, 0, 1], up: [-1, 0, 0]}
motion:
  - {at: 0, position: [0.09, 0, 0.3]}
  - {at: 2, position: [0.09, 0, 0.31], rotation: {axis: [0, 0, 1], degrees: 30}}
  - {at: 3, position: [0.09, 0, 0.3]}
fingers:
  thumb: {touches: [0, 0.03, 0]}
  index: {touches: [0.015, -0.02598, 0]}
  middle: {touches: [-0.015, -0.02598, 0]}
friction: 0.8
hand: {link_radius: 0.006}
"""
    assert load_task(tmp_path / "ball.yaml") == parse_task(expected)
    assert (tmp_path / "ball.yaml").read_text(encoding="utf-8") == edited.text
    assert not edited.unsaved
    assert not Session(tmp_path / "ball.yaml").unsaved


def test_fingers_come_and_go(tmp_path):
    edited = session(tmp_path)
    edited.edit(lambda text: with_finger(text, edited.last.written, "ring"))
    added = place(edited, "contact ring")
    others = [place(edited, f"contact {name}").position for name in ("thumb", "index", "middle")]
    assert min(np.linalg.norm(added.position - other) for other in others) > 0.03
    assert edited.understood.solvable
    edited.edit(lambda text: removed(text, added))
    assert edited.text == CAPSULE


def test_the_start_says_it_can_be_solved_and_mistakes_what_they_are(tmp_path):
    edited = session(tmp_path)
    assert edited.understood.solvable
    assert edited.understood.doubts == ()
    edited.edit(lambda text: with_value(text, ("friction",), typed("wet")))
    assert not edited.understood.solvable
    assert edited.understood.refusals[0].startswith("task.yaml:15: friction: given 'wet'")
    assert edited.last.written.friction == 0.6  # what can still be drawn
    drawn = place(edited, "palm")
    edited.edit(lambda text: moved(text, edited.last.written, drawn, drawn.position + 0.01, drawn.rotation))
    edited.edit(lambda text: with_field(text, ("friction",), " "))
    assert edited.understood.solvable
    edited.edit(lambda text: with_value(text, ("hand", "contact_force"), typed("0.1")))
    assert "hand.contact_force allows 0.1" in edited.understood.impossible[0]
    assert not edited.understood.solvable
    for _ in range(4):
        edited.undo()
    assert edited.text == CAPSULE
    assert not edited.can_undo


@pytest.mark.parametrize(
    "words", ["[1, 2", "{a: 1", "*a", "a: b: c", "!!python/object:os.system x", "\0", "1\ngravity: 2"]
)
def test_words_that_are_no_value_change_nothing(words, tmp_path):
    edited = session(tmp_path)
    with pytest.raises(TaskError):
        edited.edit(lambda text: with_field(text, ("friction",), words))
    assert edited.text == CAPSULE


def test_a_path_through_a_number_is_no_place():
    with pytest.raises(TaskError, match=r"no place for friction\.soft"):
        with_value(CAPSULE, ("friction", "soft"), 1)


def test_what_another_program_wrote_is_not_overwritten_unasked(tmp_path):
    edited = session(tmp_path)
    edited.edit(lambda text: with_value(text, ("friction",), 0.7))
    edited.path.write_text(CAPSULE + "# mine\n", encoding="utf-8")
    with pytest.raises(TaskError, match="changed by another program"):
        edited.save()
    assert edited.path.read_text(encoding="utf-8").endswith("# mine\n")
    edited.reload()
    assert edited.text.endswith("# mine\n")
    edited.undo()
    edited.save()
    assert load_task(edited.path).friction == 0.7


def test_a_file_is_saved_whole_where_its_link_leads_and_with_the_rights_it_had(tmp_path, monkeypatch):
    real = tmp_path / "real.yaml"
    real.write_text(CAPSULE, encoding="utf-8")
    real.chmod(0o640)
    link = tmp_path / "task.yaml"
    link.symlink_to(real)
    edited = Session(link)
    edited.edit(lambda text: with_value(text, ("friction",), 0.7))
    seen = []
    monkeypatch.setattr(os, "replace", lambda made, path: (seen.append(real.read_text()), os.rename(made, path)))
    edited.save()
    assert seen == [CAPSULE]  # until all of the new one is there
    assert link.is_symlink()
    assert load_task(real).friction == 0.7
    assert stat.S_IMODE(real.stat().st_mode) == 0o640
    assert sorted(each.name for each in tmp_path.iterdir()) == ["real.yaml", "task.yaml"]


def test_a_file_that_is_not_to_be_written_stays(tmp_path, monkeypatch):
    edited = session(tmp_path)
    monkeypatch.setattr(os, "access", lambda path, mode: (path, mode) != (edited.path, os.W_OK))
    edited.edit(lambda text: with_value(text, ("friction",), 0.7))
    with pytest.raises(TaskError, match="cannot be written"):
        edited.save()
    assert edited.path.read_text(encoding="utf-8") == CAPSULE


def all_fields(form):
    return [*form.fields, *(field for inner in form.forms for field in all_fields(inner))]


@pytest.mark.parametrize("file", KINDS, ids=lambda file: file.stem)
def test_the_form_has_every_field_and_writes_what_it_shows(file):
    text = file.read_text(encoding="utf-8")
    fields = all_fields(form_of(text))
    reference = describe_fields()
    for field in fields:
        assert field.about
        assert f"| `{field.name}` | {field.default} | {field.about} |" in reference
        assert field.written == shown_at(text, field.path)
        if field.written:
            again = with_value(text, field.path, typed(field.written))
            assert parse_task(again, name=file.stem) == parse_task(text, name=file.stem)
    shown = {field.path[0] for field in fields}
    assert shown >= {"name", "object", "palm", "motion", "fingers", "gravity", "hand", "limits", "search", "weights"}


def test_names_in_one_place_are_one():
    named = names_of(Session(ROOT / "problems/pick_up_and_rotate.yaml").last.written)
    assert [text for _, text, _ in named] == [
        "palm",
        "palm at 2 s, palm at 5 s",
        "start",
        "goal 1 at 2 s",
        "goal 2 at 5 s",
        "thumb",
        "index",
        "middle",
        "ground",
    ]


def test_contacts_that_the_program_places_have_no_place_yet(tmp_path):
    edited = session(tmp_path)
    edited.edit(lambda text: with_field(text, ("fingers", "index", "touches"), "anywhere"))
    assert edited.understood.solvable
    names = [each.name for each in places(edited.last.written)]
    assert "contact thumb" in names
    assert "contact index" not in names
    edited.edit(lambda text: with_field(text, ("fingers",), "3"))
    assert edited.understood.refusals == ()
    assert not [each for each in places(edited.last.written) if each.kind == "contact"]


def test_goals_of_an_object_on_a_joint_are_moved_by_their_angle(tmp_path):
    edited = session(tmp_path)
    joint = "{hinge: {point: [0, 0, 0], axis: [0, 0, 1]}}"
    edited.edit(lambda text: with_field(text, ("object", "attached"), joint))
    edited.edit(lambda text: with_field(text, ("motion", 1), "{at: 1, angle: 20}"))
    assert edited.understood.refusals == ()
    assert [each.moves for each in places(edited.last.written) if each.path[0] == "motion"] == [True, False]


@pytest.mark.parametrize("palm", ["palm: auto\n", "palm: {auto: true, radius: 0.05}\n"])
def test_a_placed_palm_is_drawn_where_it_stands_and_written_out_once_it_is_dragged(palm, tmp_path):
    start = CAPSULE.index("palm:")
    text = CAPSULE[:start] + palm + CAPSULE[CAPSULE.index("\n", start) + 1 :]
    edited = session(tmp_path, text)
    stands = place(edited, "palm")
    assert stands.position == pytest.approx(np.array(parse_task(text).palm.position))
    assert moved(text, edited.last.written, stands, stands.position, stands.rotation) == text
    drag(edited, "palm", by=(0.0, 0.0, 0.01))
    given = value_at(edited.text, ("palm",))
    assert "auto" not in given
    assert given["position"] == pytest.approx(np.add(stands.position, [0, 0, 0.01]), abs=1e-5)
    assert np.cross(given["facing"], stands.rotation[:, 2]) == pytest.approx(0, abs=1e-3)
    assert parse_task(edited.text).palm.placed is None
