import numpy as np
import pytest
from scipy.spatial.transform import Rotation as ScipyRotation

from casadi_hands.task import parse_task, task_to_yaml

# A bolt whose frame is at the end of its shank: the centre of mass is somewhere along x.
BOLT = """\
object:
  mass: 0.06
  shapes:
    - capsule: {start: [0, 0, 0], end: [0.05, 0, 0], radius: 0.01}
    - sphere: {center: [0.055, 0, 0], radius: 0.016}
palm: {position: [0, 0, 0.3], facing: [0, 0, -1]}
motion:
  - {at: 0, position: [0, 0, 0.2]}
  - {at: 2, position: [0.01, 0, 0.2], rotation: {axis: [0, 0, 1], degrees: 90}}
ground: {height: 0, touches: [0.01, 0, -0.0101]}
fingers:
  thumb: {touches: [0.03, 0.0103, 0]}
  index: {touches: [0.03, -0.01, 0.001]}
"""


def test_points_keep_their_place_in_the_world() -> None:
    task = parse_task(BOLT)
    capsule, sphere = task.object.shapes
    assert task.object.center_of_mass == (0, 0, 0)
    # The solids' first moments cancel about the new origin.
    rod, ball = capsule.body, sphere.body
    assert rod.volume * rod.centroid + ball.volume * ball.centroid == pytest.approx(np.zeros(3), abs=1e-18)
    start = np.array(capsule.start)
    shank_end = [[0, 0, 0.2], [0.01, 0, 0.2]]
    for (_, position, vector), expected in zip(task.goal_poses(), shank_end, strict=True):
        assert position + ScipyRotation.from_rotvec(vector).apply(start) == pytest.approx(expected)
    assert np.array(task.fingers["thumb"].touches) - start == pytest.approx([0.03, 0.01, 0])
    assert task.ground is not None
    assert np.array(task.ground.touches) - start == pytest.approx([0.01, 0, -0.01])


def test_contacts_are_moved_onto_the_nearest_surface() -> None:
    task = parse_task(BOLT)
    start = np.array(task.object.shapes[0].start)
    index = np.array(task.fingers["index"].touches) - start
    direction = np.array([-0.01, 0.001]) / np.hypot(0.01, 0.001)
    assert index == pytest.approx([0.03, *(0.01 * direction)])


def test_given_centre_of_mass() -> None:
    task = parse_task(BOLT.replace("mass: 0.06", "mass: 0.06\n  center_of_mass: [0.02, 0, 0.001]"))
    assert task.object.center_of_mass == (0, 0, 0)
    assert task.object.shapes[0].start == pytest.approx([-0.02, 0, -0.001])
    # The inertia stays that of the solids about their own centre.
    assert task.object.inertia == parse_task(BOLT).object.inertia


def test_saving_and_loading_changes_nothing() -> None:
    task = parse_task(BOLT)
    again = parse_task(task_to_yaml(task))
    assert again == task
    assert task_to_yaml(again) == task_to_yaml(task)


SPLIT = """\
object:
  mass: 0.1
  shapes:
    - box: {center: [-0.02, 0, 0], size: [0.04, 0.03, 0.03]}
    - SECOND
palm: {position: [0, 0, 0.1], facing: [0, 0, -1]}
motion: [{at: 0, position: [0, 0, 0]}, {at: 2, position: [0, 0, 0.01]}]
fingers:
  thumb: {touches: [0, 0.015, 0.001]}
  index: {touches: [0.0001, -0.015, 0.001]}
  middle: {touches: [-0.0001, 0.002, -0.015]}
"""
BLOCK = "box: {center: [0.02, 0, 0], size: [0.04, 0.03, 0.03]}"
CORNERS = [[x, y, z] for x in (0.0, 0.04) for y in (-0.015, 0.015) for z in (-0.015, 0.015)]


@pytest.mark.parametrize("second", [BLOCK, f"convex: {{vertices: {CORNERS}}}"], ids=["box", "polytope"])
def test_where_two_parts_meet_a_contact_is_on_a_face_of_one(second: str) -> None:
    """The seam is an edge of both, and none of the object: the normal is a face's, whichever part is touched."""
    task = parse_task(SPLIT.replace("SECOND", second))
    given = np.array([[0, 0.015, 0.001], [0.0001, -0.015, 0.001], [-0.0001, 0.002, -0.015]])
    outward = [[0, 1, 0], [0, -1, 0], [0, 0, -1]]
    for finger, before, normal in zip(task.fingers.values(), given, outward, strict=True):
        point = np.array(finger.touches)
        body = min((shape.body for shape in task.object.shapes), key=lambda each: abs(each.signed_distance(point)))
        assert body.outward(point) == pytest.approx(np.array(normal), abs=5e-3)
        assert np.linalg.norm(point - before) < 1e-3  # the solid's middle is the frame's
    assert parse_task(task_to_yaml(task)) == task


L_SHAPE = """\
object:
  mass: 0.1
  shapes:
    - box: {center: [0, 0, 0], size: [0.04, 0.03, 0.04]}
    - box: {center: [0.04, 0, -0.01], size: [0.04, 0.03, 0.02]}
palm: {position: [0, 0, 0.2], facing: [0, 0, -1]}
motion: [{at: 0, position: [0, 0, 0]}, {at: 2, position: [0, 0, 0.01]}]
fingers:
  thumb: {touches: PLACE}
  index: {touches: [0, -0.015, 0.001]}
"""


@pytest.mark.parametrize("place", [[0.02, 0, 0.0005], [0.0204, 0, 0], [0.02, 0.002, 0.003], [0.021, 0, 0]])
def test_beside_an_inner_corner_contacts_stay_where_they_are(place: list[float]) -> None:
    """One body ends there, and another begins, but its surface does not go on in the same way."""
    task = parse_task(L_SHAPE.replace("PLACE", str(place)))
    moved = np.array(task.fingers["thumb"].touches) - np.array(task.fingers["index"].touches)
    assert moved == pytest.approx(np.array(place) - [0, -0.015, 0.001], abs=1e-4)


def test_a_keel_where_parts_meet_stays_the_lowest_point() -> None:
    half = [[x, y, z] for x in (-0.03, 0.03) for y, z in ((0.0, 0.0), (0.02, 0.01), (0.0, 0.02), (0.02, 0.02))]
    other = [[x, -y, z] for x, y, z in half]
    task = parse_task(
        f"object: {{mass: 0.1, shapes: [{{convex: {{vertices: {half}}}}}, {{convex: {{vertices: {other}}}}}]}}\n"
        "palm: {position: [0, 0, 0.2], facing: [0, 0, -1]}\n"
        "motion: [{at: 0, position: [0, 0, 0]}, {at: 2, position: [0, 0, 0.01]}]\n"
        "ground: {height: 0, touches: [0.001, 0, 0]}\n"
        "fingers: {thumb: {touches: [0, 0.02, 0.015]}, index: {touches: [0, -0.02, 0.015]}}\n"
    )
    lowest = min(point[2] for shape in task.object.shapes for point in np.asarray(shape.vertices))
    assert task.ground is not None
    assert task.ground.touches[2] == pytest.approx(lowest, abs=5e-5)
    assert task.ground.touches[1] == pytest.approx(0, abs=1e-4)


def test_an_edge_of_the_object_stays_where_a_person_put_a_contact() -> None:
    given = SPLIT.replace("SECOND", BLOCK).replace("[0, 0.015, 0.001]", "[0.01, 0.015, 0.015]")
    task = parse_task(given)
    body, point = task.object.shapes[1].body, np.array(task.fingers["thumb"].touches)
    assert body.outward(point) == pytest.approx(np.array([0, 1, 1]) / np.sqrt(2), abs=1e-6)
