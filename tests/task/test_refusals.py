"""Every kind of wrong task file, and the whole message it gets."""

import re
from pathlib import Path

import pytest

from casadi_hands.errors import TaskError
from casadi_hands.task import load_task, parse_task

GOOD = """\
name: a capsule
object:
  mass: 0.1
  shapes:
    - capsule: {start: [0, 0, -0.04], end: [0, 0, 0.04], radius: 0.02}
palm:
  radius: 0.06
  position: [0, 0, 0.3]
  facing: [1, 0, 0]
motion:
  - {at: 0, position: [0.075, 0, 0.3]}
  - {at: 2, position: [0.125, 0, 0.3]}
  - {at: 4, position: [0.075, 0, 0.3]}
fingers:
  thumb: {touches: [0, 0.02, -0.01]}
  index: {touches: [0, -0.02, 0.02]}
"""
MOTION = GOOD[GOOD.index("motion:") : GOOD.index("fingers:")]
LATER_GOALS = MOTION[MOTION.index("  - {at: 2") :]
FINGERS = GOOD[GOOD.index("fingers:") :]
DRAWING = GOOD.replace("motion:", "tool: [0, 0, -0.06]\nmotion:").replace("position: [0.075,", "tool_at: [0.075,")
DRAWING = DRAWING.replace("position: [0.125,", "tool_at: [0.125,")


def message(text: str) -> str:
    with pytest.raises(TaskError) as caught:
        parse_task(text, "wrong.yaml")
    return str(caught.value)


def test_the_files_that_the_others_spoil_are_right() -> None:
    assert parse_task(GOOD).name == "a capsule"
    assert parse_task(DRAWING).draws


# What is replaced in GOOD, by what, and the message; `...` in a message stands for anything.
SPOILT = {
    "unknown field": (
        "mass: 0.1",
        "mass: 0.1\n  weight: 1",
        "4: object.weight: given an unknown field; allowed: mass, shapes, center_of_mass, inertia, attached, meshes",
    ),
    "unknown field of a section within one that may be missing": (
        "mass: 0.1",
        "mass: 0.1\n  attached: {slider: {axis: [1, 0, 0], friction: 2}}",
        "4: object.attached.slider.friction: given an unknown field; allowed: axis, stiffness, damping, "
        "friction_force; did you mean friction_force?",
    ),
    "missing field of such a section": (
        "mass: 0.1",
        "mass: 0.1\n  attached: {slider: {friction_force: 2}}",
        "4: object.attached.slider.axis: given nothing; allowed: a value, it has no default: Direction of the axis...",
    ),
    "misspelt field": (
        "  mass:",
        "  mas:",
        "3: object.mas: given an unknown field; allowed: ...did you mean mass?",
    ),
    "field in the wrong place": (
        "name:",
        "seed: 1\nname:",
        "1: seed: given an unknown field; ...did you mean search.seed?",
    ),
    "missing field": (
        "  mass: 0.1\n",
        "",
        "2: object.mass: given nothing; allowed: a value, it has no default: Mass, kg.",
    ),
    "missing section": (
        MOTION,
        "",
        (
            "1: motion: given nothing; allowed: a value, it has no default: Goals that the object passes "
            "through, in order of time."
        ),
    ),
    "negative mass": (
        "mass: 0.1",
        "mass: -0.1",
        "3: object.mass: given -0.1; allowed: a number greater than 0",
    ),
    "unit in a number": (
        "radius: 0.06",
        "radius: 5cm",
        (
            "7: palm.radius: given '5cm'; allowed: a number (without quotes or unit; lengths in m, times in s, "
            "masses in kg)"
        ),
    ),
    "quoted number": (
        "mass: 0.1",
        'mass: "0.1"',
        "3: object.mass: given '0.1'; allowed: a number (without quotes...",
    ),
    "boolean for a number": (
        "mass: 0.1",
        "mass: true",
        "3: object.mass: given true; allowed: a number (without...",
    ),
    "not a number": (
        "[0, 0, 0.3]\n  facing",
        "[0, .nan, 0.3]\n  facing",
        "8: palm.position[1]: given nan; allowed: a finite number",
    ),
    "infinite": (
        "mass: 0.1",
        "mass: .inf",
        "3: object.mass: given inf; allowed: a finite number",
    ),
    "empty value": (
        "mass: 0.1",
        "mass:",
        "3: object.mass: given nothing; allowed: a number (without...",
    ),
    "vector too short": (
        "facing: [1, 0, 0]",
        "facing: [1, 0]",
        "9: palm.facing: given [1, 0]; allowed: a list of 3 numbers",
    ),
    "vector too long": (
        "facing: [1, 0, 0]",
        "facing: [1, 0, 0, 0]",
        "9: palm.facing: given [1, 0, 0, 0]; allowed: a list of 3 numbers",
    ),
    "number for a vector": (
        "facing: [1, 0, 0]",
        "facing: 1",
        "9: palm.facing: given 1; allowed: a list of 3 numbers",
    ),
    "list for a mapping": (
        "palm:",
        "search: [1]\npalm:",
        (
            "6: search: given [1]; allowed: a mapping with the fields trials, recombinations, max_joints, "
            "threshold, seed"
        ),
    ),
    "mapping for a list": (
        MOTION,
        "motion: {at: 0}\n",
        "10: motion: given a mapping of at; allowed: a list",
    ),
    "facing nowhere": (
        "facing: [1, 0, 0]",
        "facing: [0, 0, 0]",
        "9: palm.facing: given [0, 0, 0]; allowed: a direction: at least one number other than 0",
    ),
    "up along facing": (
        "facing: [1, 0, 0]",
        "facing: [1, 0, 0]\n  up: [-2, 0, 0]",
        "6: palm: given ...; allowed: an `up` that is not parallel to where the palm faces",
    ),
    "unknown shape": (
        "capsule: {start",
        "cone: {start",
        ("5: object.shapes[0]: given a mapping of cone; allowed: sphere: {radius} or capsule: {start, end, radius}..."),
    ),
    "shape without a kind": (
        "capsule: {start: [0, 0, -0.04], end: [0, 0, 0.04], radius: 0.02}",
        "{radius: 0.02, center: [0, 0, 0]}",
        (
            "5: object.shapes[0]: given a mapping of radius, center; allowed: sphere: {radius} or "
            "capsule: {start, end, radius}..."
        ),
    ),
    "no shapes": (
        "    - capsule: {start: [0, 0, -0.04], end: [0, 0, 0.04], radius: 0.02}",
        "    []",
        "4: object.shapes: given 0 of them; allowed: at least 1: The primitives...",
    ),
    "radius of nothing": (
        "radius: 0.02",
        "radius: 0",
        "5: object.shapes[0].capsule.radius: given 0; allowed: a number greater than 0",
    ),
    "field of a shape": (
        "radius: 0.02",
        "radius: 0.02, length: 1",
        "5: object.shapes[0].capsule.length: given an unknown field; allowed: name, start, end, radius",
    ),
    "centre of mass outside": (
        "mass: 0.1",
        "mass: 0.1\n  center_of_mass: [0.5, 0, 0]",
        "4: object.center_of_mass: given [0.5, 0.0, 0.0]; allowed: a point within the box around the object's shapes",
    ),
    "inertia not symmetric": (
        "mass: 0.1",
        "mass: 0.1\n  inertia: [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]",
        "4: object.inertia: given ...; allowed: a symmetric matrix",
    ),
    "inertia not positive": (
        "mass: 0.1",
        "mass: 0.1\n  inertia: [[1, 0, 0], [0, 1, 0], [0, 0, 0]]",
        "4: object.inertia: given ...; allowed: a positive definite matrix: every principal moment above 0",
    ),
    "inertia of no body": (
        "mass: 0.1",
        "mass: 0.1\n  inertia: [[1, 0, 0], [0, 1, 0], [0, 0, 2.1]]",
        (
            "4: object.inertia: given ...; allowed: principal moments of which none exceeds the sum of the other "
            "two, as no solid body has them"
        ),
    ),
    "contact off the object": (
        "[0, 0.02, -0.01]",
        "[0, 0.06, -0.01]",
        (
            "15: fingers.thumb.touches: given [0.0, 0.06, -0.01]; allowed: a point within 0.012 m of the "
            "object's surface; this one is 0.04 m from it"
        ),
    ),
    "contact inside another shape": (
        "radius: 0.02}",
        "radius: 0.02}\n    - sphere: {center: [0, 0, 0], radius: 0.03}",
        (
            "16: fingers.thumb.touches: given [0.0, 0.02, -0.01]; allowed: a point on the outside of the object; "
            "this one lies inside object.shapes[1]\n"
            "17: ..."
        ),
    ),
    "two contacts in one place": (
        "[0, -0.02, 0.02]",
        "[0, 0.02, -0.01]",
        (
            "16: fingers.index.touches: given [0.0, 0.02, -0.01]; allowed: a point away from that of thumb, "
            "since two fingertips cannot be in one place"
        ),
    ),
    "no fingers": (
        FINGERS,
        "fingers: {}\n",
        "14: fingers: given 0 of them; allowed: at least 1: The fingers by name, one contact each...",
    ),
    "one finger against gravity": (
        "  index: {touches: [0, -0.02, 0.02]}\n",
        "",
        "14: fingers: given one finger; allowed: two or more; a single contact cannot hold an object against gravity",
    ),
    "finger called ground": (
        "  index:",
        "  ground:",
        "14: fingers: given ...; allowed: names of letters, digits, _ and -, and not 'ground'; 'ground' is not",
    ),
    "one goal": (
        LATER_GOALS,
        "",
        "10: motion: given 1 of them; allowed: at least 2: Goals that the object passes through, in order of time.",
    ),
    "late first goal": (
        "at: 0",
        "at: 0.5",
        "11: motion[0].at: given 0.5; allowed: 0: the first goal is where the motion starts",
    ),
    "goals out of order": (
        "at: 2",
        "at: 5",
        "13: motion[2].at: given 4; allowed: a time later than that of the goal before, 5 s",
    ),
    "goals too close": (
        "at: 2",
        "at: 0.2",
        "12: motion[1].at: given 0.2; allowed: goals at least 0.3 s apart: (keyframes_between + 1) × time_step",
    ),
    "goal after the end": (
        "name:",
        "duration: 3\nname:",
        "14: motion[2].at: given 4; allowed: a time within the duration, 3 s",
    ),
    "negative time": (
        "at: 0,",
        "at: -1,",
        "11: motion[0].at: given -1; allowed: a number of at least 0",
    ),
    "goal without a place": (
        "at: 2, position: [0.125, 0, 0.3]",
        "at: 2",
        "12: motion[1]: given a mapping of at; allowed: a position, or tool_at in a drawing task",
    ),
    "pose and tool point": (
        "at: 2,",
        "at: 2, tool_at: [0, 0, 0],",
        (
            "12: motion[1]: given a mapping of at, tool_at, position; allowed: either position and rotation, or "
            "tool_at; not both"
        ),
    ),
    "drawing without a tool": (
        "at: 2, position",
        "at: 2, tool_at",
        (
            "12: motion[1].tool_at: given [0.125, 0.0, 0.3] without a tool; allowed: goals by position and "
            "rotation; to draw, also give `tool`, the point of the object that draws"
        ),
    ),
    "tool without drawing": (
        "name:",
        "tool: [0, 0, -0.06]\nname:",
        (
            "12: motion[0].position: given a pose; allowed: tool_at in every goal, since `tool` makes this a "
            "drawing task\n"
            "..."
        ),
    ),
    "zero axis": (
        "at: 2,",
        "at: 2, rotation: {axis: [0, 0, 0], degrees: 9},",
        (
            "12: motion[1].rotation: given a mapping of axis, degrees; allowed: an axis with at least one number "
            "other than 0"
        ),
    ),
    "axis without an angle": (
        "at: 2,",
        "at: 2, rotation: {axis: [0, 0, 1]},",
        (
            "12: motion[1].rotation.degrees: given nothing; allowed: a value, it has no default: Angle of the "
            "turn, degrees; may exceed 180 to say which way round."
        ),
    ),
    "zero quaternion": (
        "at: 2,",
        "at: 2, rotation: {quaternion: [0, 0, 0, 0]},",
        "12: motion[1].rotation: given a mapping of quaternion; allowed: a quaternion [w, x, y, z] other than 0",
    ),
    "short quaternion": (
        "at: 2,",
        "at: 2, rotation: {quaternion: [1, 0, 0]},",
        "12: motion[1].rotation.quaternion: given [1, 0, 0]; allowed: a list of 4 numbers",
    ),
    "quaternion with its real part last": (
        "at: 2,",
        "at: 2, rotation: {quaternion: [0, 0, 0.5, 0.866]},",
        (
            "12: motion[1].rotation.quaternion: given [0, 0, 0.5, 0.866]; allowed: [w, x, y, z]; is the order of this "
            "one x, y, z, w, a turn by 60°? Then write [0.866, 0, 0, 0.5]. If 180° are meant: {axis: [0, 0.5, 0.866], "
            "degrees: 180}"
        ),
    ),
    "lengths in millimetres": (
        "{start: [0, 0, -0.04], end: [0, 0, 0.04], radius: 0.02}",
        "{start: [0, 0, -40], end: [0, 0, 40], radius: 20}",
        # 0.1 kg over π·20²·80 + 4/3·π·20³ = 134041 m³.
        (
            "4: object.shapes: given an object 120 m long of 0.1 kg, 7.5e-07 kg/m³; allowed: lengths in m, masses in "
            "kg, of 0.1 kg/m³ and more; is the file in millimetres?"
        ),
    ),
    "mass in grams": (
        "mass: 0.1",
        "mass: 100",
        (
            "3: object.mass: given 100 kg for an object 0.12 m long, 7.5e+05 kg/m³; allowed: masses in kg, of "
            "200000 kg/m³ and less; is this one in grams?"
        ),
    ),
    "angle and quaternion": (
        "at: 2,",
        "at: 2, rotation: {quaternion: [1, 0, 0, 0], degrees: 3},",
        (
            "12: motion[1].rotation: given a mapping of quaternion, degrees; allowed: either {axis, degrees} or "
            "{quaternion: [w, x, y, z]}, not both"
        ),
    ),
    "turn too long": (
        "at: 2,",
        "at: 2, rotation: {axis: [0, 0, 1], degrees: -721},",
        (
            "12: motion[1].rotation: given -721 degrees; allowed: turns about one axis that are at most "
            "720° apart; this one is 721°"
        ),
    ),
    "turn too long in all": (  # not about one axis
        MOTION,
        "motion:\n"
        "  - {at: 0, position: [0.125, 0, 0.3], rotation: {axis: [0, 1, 0], degrees: 90}}\n"
        "  - {at: 2, position: [0.125, 0, 0.3], rotation: {quaternion: [0.0616, 0.7044, 0.0616, 0.7044]}}\n"
        "  - {at: 4, position: [0.125, 0, 0.3], rotation: {quaternion: [0.7006, -0.1227, 0.6921, -0.1227]}}\n",
        (
            "13: motion[2].rotation: given 91.05 degrees; allowed: a turn of at most ±300° from the first goal's "
            "orientation; this one is 340°"
        ),
    ),
    "object inside the palm": (
        "at: 0, position: [0.075,",
        "at: 0, position: [0.015,",
        (
            "11: motion[0].position: given [0.015, 0.0, 0.3]; allowed: a place where the object is clear of the "
            "palm; here it is 0.005 m inside"
        ),
    ),
    "goal inside a fixed palm": (
        "at: 2, position: [0.125,",
        "at: 2, position: [-0.03,",
        (
            "12: motion[1].position: given [-0.03, 0.0, 0.3]; allowed: a place where the object is clear of the "
            "palm; here it is 0.002 m inside"
        ),
    ),
    "object below the ground": (
        "name:",
        "ground: {height: 0.25}\nname:",
        (
            "9: palm.position: ...\n"
            "12: motion[0].position: given [0.075, 0.0, 0.3]; allowed: a place where the object is above the "
            "ground; here it is 0.01 m below\n"
            "..."
        ),
    ),
    "palm below the ground": (
        "palm:\n  radius: 0.06",
        "ground: {height: 0.24}\npalm:\n  radius: 0.07",
        (
            "9: palm.position: given [0.0, 0.0, 0.3]; allowed: a place where the whole palm is above the ground; "
            "here it is 0.01 m below"
        ),
    ),
    "waypoints out of order": (
        "facing: [1, 0, 0]",
        "facing: [1, 0, 0]\n  motion: [{at: 3, position: [0, 0, 0.3]}, {at: 2, position: [0, 0, 0.3]}]",
        "10: palm.motion[1].at: given 2; allowed: a time later than that of the waypoint before, 3 s",
    ),
    "perturbation backwards": (
        "name:",
        "perturbations: [{from: 2, to: 1, force: [1, 0, 0]}]\nname:",
        "1: perturbations[0]: given ...; allowed: a time `from` before the time `to`",
    ),
    "perturbation after the end": (
        "name:",
        "perturbations: [{from: 2, to: 9, force: [1, 0, 0]}]\nname:",
        "1: perturbations[0].to: given 9; allowed: a time within the duration, 4 s",
    ),
    "perturbation of nothing": (
        "name:",
        "perturbations: [{from: 2, to: 3}]\nname:",
        "1: perturbations[0]: given ...; allowed: a force or a torque other than 0",
    ),
    "no friction": (
        "name:",
        "friction: 0\nname:",
        "1: friction: given 0; allowed: a number greater than 0",
    ),
    "long time step": (
        "name:",
        "time_step: 0.2\nname:",
        "1: time_step: given 0.2; allowed: a number of at most 0.1",
    ),
    "many keyframes": (
        "name:",
        "keyframes_between: 4\nname:",
        "1: keyframes_between: given 4; allowed: a number of at most 3",
    ),
    "half a keyframe": (
        "name:",
        "keyframes_between: 1.5\nname:",
        "1: keyframes_between: given 1.5; allowed: a whole number",
    ),
    "lengths reversed": (
        "name:",
        "hand: {link_length: [0.1, 0.02]}\nname:",
        "1: hand.link_length: given [0.1, 0.02]; allowed: [min, max] with 0 < min <= max",
    ),
    "hinge too short for its links": (
        "name:",
        "hand: {link_radius: 0.01, hinge_length: 0.02}\nname:",
        "1: hand.hinge_length: given 0.02; allowed: 0, or at least 2.1 × link_radius (0.021) and less than the "
        "shortest link (0.03)",
    ),
    "hinge as long as the shortest link": (
        "name:",
        "hand: {link_radius: 0.01, link_length: [0.04, 0.1], hinge_length: 0.04}\nname:",
        "1: hand.hinge_length: given 0.04; allowed: 0, or at least 2.1 × link_radius (0.021) and less than the "
        "shortest link (0.04)",
    ),
    "fingertip thinner than links": (
        "name:",
        "hand: {link_radius: 0.01}\nfingertip: {radius: 0.009}\nname:",
        "2: fingertip.radius: given 0.009; allowed: at least hand.link_radius (0.01), that of the links behind it",
    ),
    "fingertip too thick for its link": (
        "name:",
        "hand: {link_radius: 0.01, link_length: [0.03, 0.051]}\nfingertip: {radius: 0.0201}\nname:",
        "2: fingertip.radius: given 0.0201; allowed: at most 0.02, or longer links (hand.link_length): with its hinge "
        "the last link is at least 0.05121 long, and links are at most 0.051",
    ),
    "fingertip of words": (
        "name:",
        "fingertip: {radius: wide}\nname:",
        "1: fingertip.radius: given 'wide'; allowed: a number (without quotes or unit; lengths in m, ...",
    ),
    "hinge of less than nothing": (
        "name:",
        "hand: {hinge_length: -0.01}\nname:",
        "1: hand.hinge_length: given -0.01; allowed: a number of at least 0",
    ),
    "hinge of words": (
        "name:",
        "hand: {hinge_length: some}\nname:",
        "1: hand.hinge_length: given 'some'; allowed: a number (without quotes or unit; lengths in m, ...",
    ),
    "joint limits reversed": (
        "name:",
        "hand: {joint_limits: [90, -90]}\nname:",
        "1: hand.joint_limits: given [90, -90]; allowed: [lower, upper] in degrees with -180 <= lower < upper <= 180",
    ),
    "joint limits too wide": (
        "name:",
        "hand: {joint_limits: [-200, 90]}\nname:",
        "1: hand.joint_limits: given [-200, 90]; allowed: [lower, upper]...",
    ),
    "bend below straight": (
        "name:",
        "hand: {bend: -5}\nname:",
        "1: hand.bend: given -5; allowed: a number of at least 0",
    ),
    "bend back onto the link before": (
        "name:",
        "hand: {bend: 150}\nname:",
        "1: hand.bend: given 150; allowed: a number of at most 120",
    ),
    "bend in words": (
        "name:",
        "hand: {bend: none}\nname:",
        "1: hand.bend: given 'none'; allowed: a number (without quotes or unit; ...)",
    ),
    "angles of axes reversed": (
        "name:",
        "hand: {axes: {from_link: [90, 60]}}\nname:",
        (
            "1: hand.axes.from_link: given [90, 60]; allowed: [least, largest] in degrees with "
            "0 <= least <= largest <= 90"
        ),
    ),
    "angles of axes beyond across": (
        "name:",
        "hand: {axes: {from_link: [60, 100]}}\nname:",
        "1: hand.axes.from_link: given [60, 100]; allowed: [least, largest] in degrees...",
    ),
    "angle of axes below along": (
        "name:",
        "hand: {axes: {from_link: [-10, 60]}}\nname:",
        "1: hand.axes.from_link: given [-10, 60]; allowed: [least, largest] in degrees...",
    ),
    "least angle of axes only": (
        "name:",
        "hand: {axes: {from_link: 60}}\nname:",
        "1: hand.axes.from_link: given 60; allowed: a list of 2 numbers",
    ),
    "angles of axes without a name": (
        "name:",
        "hand: {axes: [60, 90]}\nname:",
        "1: hand.axes: given [60, 90]; allowed: ...from_link...",
    ),
    "misspelt angles of axes": (
        "name:",
        "hand: {axes: {from_links: [60, 90]}}\nname:",
        "1: hand.axes.from_links: given an unknown field; allowed: ...from_link...",
    ),
    "motor that gives way to everything": (
        "name:",
        "actuator: {stiffness: 0}\nname:",
        "1: actuator.stiffness: given 0; allowed: a number greater than 0",
    ),
    "fingertip that helps a twist": (
        "name:",
        "fingertip: {torsion: -0.001}\nname:",
        "1: fingertip.torsion: given -0.001; allowed: a number of at least 0",
    ),
    "unknown weight": (
        "name:",
        "weights: {floating: {taks: 1}}\nname:",
        (
            "1: weights.floating.taks: given an unknown field; allowed: linear_momentum, ...friction_sharpness; "
            "did you mean task?"
        ),
    ),
    "negative weight": (
        "name:",
        "weights: {synthesis: {torque: -1}}\nname:",
        "1: weights.synthesis.torque: given -1; allowed: a number of at least 0",
    ),
    "annealed weight": (
        "name:",
        "weights: {synthesis: {collision: 3}}\nname:",
        "1: weights.synthesis.collision: given 3; allowed: a list of 3 numbers, one for each annealing step",
    ),
    "negative limit": (
        "name:",
        "limits: {slip: -1}\nname:",
        "1: limits.slip: given -1; allowed: a number of at least 0",
    ),
    "no trials": (
        "name:",
        "search: {trials: 0}\nname:",
        "1: search.trials: given 0; allowed: a number of at least 1",
    ),
    "text for a flag": (
        "radius: 0.06",
        "moves: sometimes",
        "7: palm.moves: given 'sometimes'; allowed: true or false",
    ),
    "number for text": (
        "name: a capsule",
        "name: 3",
        "1: name: given 3; allowed: text",
    ),
    "date for a number": (
        "mass: 0.1",
        "mass: 2020-01-01",
        "3: object.mass: given '2020-01-01'; allowed: a number (without...",
    ),
}


@pytest.mark.parametrize("kind", SPOILT)
def test_message(kind: str) -> None:
    old, new, expected = SPOILT[kind]
    assert old in GOOD
    lines = [f"wrong.yaml:{line}" if re.match(r"\d+:", line) else line for line in expected.split("\n")]
    pattern = ".*".join(re.escape(part) for part in "\n".join(lines).split("..."))
    text = message(GOOD.replace(old, new, 1))
    assert re.fullmatch(pattern, text, re.DOTALL), text
    if "\n" not in expected:
        assert "\n" not in text, "one mistake, one line"


def test_drawing_goal_under_the_ground() -> None:
    text = DRAWING.replace("name:", "ground: {height: 0.31}\nname:").replace(
        "position: [0, 0, 0.3]", "position: [0, 0, 1]"
    )
    assert message(text).startswith(
        "wrong.yaml:13: motion[0].tool_at: given [0.075, 0.0, 0.3]; allowed: a place where the object is above the "
        "ground; here it is 0.01 m below\nwrong.yaml:14: motion[1].tool_at: "
    )


def test_contact_on_an_axis() -> None:
    thin = GOOD.replace("radius: 0.02", "radius: 0.002").replace("-0.02, 0.02", "-0.002, 0.02")
    assert message(thin.replace("[0, 0.02, -0.01]", "[0, 0, -0.01]")) == (
        "wrong.yaml:15: fingers.thumb.touches: given [0.0, 0.0, -0.01]; allowed: a point off the axis or middle of its "
        "primitive, so that one side is nearest"
    )


def test_tool_far_from_the_object() -> None:
    assert message(DRAWING.replace("[0, 0, -0.06]", "[0, 0, -6]")) == (
        "wrong.yaml:10: tool: given [0.0, 0.0, -6.0]; allowed: a point within 0.06 m of the object; this one is 5.94 m "
        "from it"
    )


def test_every_mistake_has_its_line() -> None:
    text = GOOD.replace("mass: 0.1", "mass: -1").replace("facing: [1, 0, 0]", "facing: [1]").replace("at: 2,", "")
    assert [line.split(" ")[0] + line.split(" ")[1] for line in message(text).split("\n")] == [
        "wrong.yaml:3:object.mass:",
        "wrong.yaml:9:palm.facing:",
        "wrong.yaml:12:motion[1].at:",
    ]


NOT_A_TASK = {
    "empty": (
        "",
        "wrong.yaml: empty; a task file needs at least object, palm, motion and fingers",
    ),
    "only a comment": (
        "# later\n",
        "wrong.yaml: empty; a task file needs at least object, palm, motion and fingers",
    ),
    "a list": (
        "- 1\n",
        "wrong.yaml:1: given a list; a task file is a mapping of fields such as object, palm, motion and fingers",
    ),
    "a word": (
        "hello\n",
        "wrong.yaml:1: given 'hello'; a task file is a mapping of fields such as object, palm, motion and fingers",
    ),
    "an open bracket": (
        "name: x\npalm: {radius: [1\nmotion: 3\n",
        "wrong.yaml:...: not YAML: ...; mend that line or the one before",
    ),
    "a tab": (
        "object:\n\tmass: 1\n",
        "wrong.yaml:2: not YAML: found character '\\t' that cannot start any token; mend that line or the one before",
    ),
    "an undefined anchor": (
        "name: *x\n",
        "wrong.yaml:1: not YAML: found undefined alias 'x'; mend that line or the one before",
    ),
    "an anchor in itself": (
        "name: &x [*x]\n",
        "wrong.yaml:1: name[0]: given an alias of what it stands in; allowed: aliases of what is written elsewhere",
    ),
    "control characters": (
        "name: \x00\n",
        "wrong.yaml:1: given the character '\\x00'; a task file is text",
    ),
    "two documents": (
        "name: x\n---\nname: y\n",
        "wrong.yaml:2: not YAML: but found another document; mend that line or the one before",
    ),
    "a field given twice": (
        "name: x\nobject: {mass: 1, mass: 2}\n",
        "wrong.yaml:2: mass: given twice; each field may be given once",
    ),
    "deep nesting": (
        (
            "a: "
            "[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]"
        ),
        "wrong.yaml:1: nested too deeply, in more than 20 levels; a task file needs a few",
    ),
}


@pytest.mark.parametrize("kind", NOT_A_TASK)
def test_not_a_task(kind: str) -> None:
    text, expected = NOT_A_TASK[kind]
    pattern = ".*".join(re.escape(part) for part in expected.split("..."))
    found = message(text)
    assert re.fullmatch(pattern, found, re.DOTALL), found


def test_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(TaskError, match=r"none\.yaml: no such file; give the path of a task file$"):
        load_task(tmp_path / "none.yaml")


def test_directory(tmp_path: Path) -> None:
    with pytest.raises(TaskError, match=r"is a directory; give the path of a task file in it$"):
        load_task(tmp_path)


def test_binary_file(tmp_path: Path) -> None:
    (tmp_path / "mesh.stl").write_bytes(bytes(range(256)))
    with pytest.raises(TaskError, match=r"mesh\.stl: not a text file; a task file is YAML in UTF-8$"):
        load_task(tmp_path / "mesh.stl")


def test_message_names_the_file(tmp_path: Path) -> None:
    (tmp_path / "heavy.yaml").write_text(GOOD.replace("mass: 0.1", "mass: heavy"))
    with pytest.raises(TaskError, match=r"heavy\.yaml:3: object\.mass: given 'heavy'"):
        load_task(tmp_path / "heavy.yaml")
