"""What the stages' variables and parameters are, in words and units, for those who read their programs.

Lengths are in units of the characteristic length, forces in m·g; a pose is a position and a rotation vector from the
reference orientation, both in the world.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from casadi_hands.nlp.program_index import Quantity

_DISTURBED = "_perturbed"
_POSE, _TORQUE = "length, rad", "m·g·length"
_QUANTITIES = {
    # Variables.
    "pose": Quantity("object's pose in the world, one row a keyframe or knot", _POSE),
    "rate": Quantity("object's velocity (world) and angular velocity (object frame)", "length/s, rad/s"),
    "point": Quantity("contact points on the object, object frame, three entries a contact", "length"),
    "force": Quantity("contact forces on the object, three entries a contact; object frame", "m·g"),
    "force_perturbed": Quantity("contact forces on the object under the disturbances; object frame", "m·g"),
    "force_disturbed": Quantity("contact forces on the object under the disturbances; object frame", "m·g"),
    "wrench": Quantity("the contacts' force and torque on the object; object frame", f"m·g, {_TORQUE}"),
    "middle_torque": Quantity("the contacts' torque halfway between two knots; object frame", _TORQUE),
    "invariant": Quantity("contact invariants: 1 where a contact acts, 0 where it does not", ""),
    "coordinate": Quantity("of the joint that holds the object", "rad or length"),
    "coordinate_speed": Quantity("of the joint's coordinate", "rad/s or length/s"),
    "drag": Quantity("the joint's friction along its coordinate, of all it has", ""),
    "palm": Quantity("palm's offset from its given motion: translation and rotation vector, world", _POSE),
    "torsion": Quantity("moments of contacts about the object's outward normals, over their radius", "m·g"),
    "twist_torque": Quantity("the torque of all contacts' torsion; object frame", _TORQUE),
    "spin": Quantity("how fast the object turns on each fingertip, about its outward normal", "rad/s"),
    "slip": Quantity(
        "how fast the contact goes over the object faster than over its fingertip, across the surface", "length/s"
    ),
    "sticking": Quantity("tangential force beside that of sliding, over friction and what the slip leaves of it", ""),
    "base": Quantity("where the finger stands on the palm", "length"),
    "lengths": Quantity("of the links", "length"),
    "axes": Quantity("of the joints: two exponential coordinates each, from the frames' third columns", "rad"),
    "bends": Quantity(
        "of the links at zero angle, from the link before: rotation vectors about its x and y axes", "rad"
    ),
    "angles": Quantity("of the joints, one row a keyframe or knot", "rad"),
    "tips": Quantity("where on the fingertip's surface the contact is, for each time that it touches", "length"),
    # The object and what acts on it.
    "reference": Quantity("reference orientation: quaternion w, x, y, z", ""),
    "step": Quantity("time step, or the time between two knots", "s"),
    "gravity": Quantity("object's weight, world", "m·g"),
    "inertia": Quantity("object's inertia, object frame, by columns", "m·length²"),
    "inverse": Quantity("inverse of the inertia", "1/(m·length²)"),
    "inertial": Quantity("characteristic length over gravity: turns length/s² into m·g", "s²"),
    "external_force": Quantity("disturbing force, world", "m·g"),
    "external_torque": Quantity("disturbing torque, world", _TORQUE),
    "planned_force": Quantity("the world's answer to what the object exerts on it, world", "m·g"),
    "planned_torque": Quantity("the world's answer to what the object exerts on it, world", _TORQUE),
    "freedom": Quantity("velocity and angular velocity that a joint lets an attached object have; object frame", ""),
    "resistance": Quantity("spring, damper and friction of the joint, along it", "m·g or m·g·length"),
    "turn_axis": Quantity("axis of the joint, 0 of a slider; world", ""),
    "joint_axis": Quantity("axis of the joint; world", ""),
    "joint_start": Quantity("object's position where the joint's coordinate is 0; world", "length"),
    "pivot": Quantity("a point of the joint's axis where its coordinate is 0; world", "length"),
    "advance": Quantity("along the joint's axis, over its coordinate", "length/rad or 1"),
    "joint_mass": Quantity("inertia along the joint's coordinate", "m·length² or m"),
    "joint_friction": Quantity("largest dry friction of the joint", "m·g·length or m·g"),
    "joint_stiffness": Quantity("of the joint's spring", "m·g·length/rad or m·g/length"),
    "joint_damping": Quantity("of the joint's damper", "m·g·length·s/rad or m·g·s/length"),
    "carried_acceleration": Quantity("of an object that goes as the palm does, world", "length/s²"),
    "bodies": Quantity(
        "parameters of all bodies that the object is made of; object frame, of synthesis palm frame", "length"
    ),
    "object": Quantity("parameters of the object's body of this number; object frame", "length"),
    "body": Quantity("parameters of the body that the contact is on; object frame", "length"),
    "ground_body": Quantity("parameters of the body that stands on the ground; object frame", "length"),
    # Contacts.
    "friction": Quantity("coefficient of friction, or the part of it that may be used", ""),
    "ground_friction": Quantity("the ground's, likewise", ""),
    "sliding_friction": Quantity("coefficient of friction, all of it", ""),
    "cone_friction": Quantity("coefficient of friction, nearly all of it", ""),
    "slide_margin": Quantity("part of the friction that may be used where a contact rests", ""),
    "slip_scale": Quantity("slip at which 0.7 of the friction acts against it", "length/s"),
    "torsion_radius": Quantity("of the torsional friction: largest moment over normal force", "length"),
    "bearing_moment": Quantity("largest on a bearing across its joint's axis", _TORQUE),
    "link_stress": Quantity("largest in a link", "m·g/length²"),
    "tip_deflection": Quantity("farthest that a fingertip may bend away", "length"),
    "flexibility": Quantity("4/(π E) of the links' material", "length²/(m·g)"),
    "holding": Quantity("share of a fingertip's torsion that balance asks for, of what its spin leaves free", ""),
    "spin_scale": Quantity("spin at which 0.7 of the torsion acts against it", "rad/s"),
    "sharpness": Quantity("exponent of the friction cone's penalty", "1/(m·g)"),
    "patches": Quantity("where contacts are wanted; object frame", "length"),
    "tie": Quantity("how strongly the contact is held to where it is wanted", ""),
    "helper": Quantity("directions across the surface, from which tangents are made; object frame", ""),
    "face_normals": Quantity("outward normals of half-spaces that keep a contact off edges; object frame", ""),
    "face_offsets": Quantity("of these half-spaces, along their normals", "length"),
    "margin_direction": Quantity("signs of the singularity margin to be kept: which way the finger bends", ""),
    # Goals.
    "targets": Quantity("goals' positions, world", "length"),
    "vectors": Quantity("goals' rotation vectors, world", "rad"),
    "goals": Quantity("goals' poses, world", _POSE),
    "straight": Quantity("poses on the straight way between the goals", _POSE),
    "tool": Quantity("the tool's tip, object frame", "length"),
    "tool_path": Quantity("where the tool is to be, world", "length"),
    "wanted_pose": Quantity("the motion that costs hold near to", _POSE),
    "wanted_point": Quantity("contact points that costs hold near to; object frame", "length"),
    "wanted_force": Quantity("contact forces that costs hold near to; object frame", "m·g"),
    # The palm and other bodies.
    "palm_position": Quantity("world", "length"),
    "palm_quaternion": Quantity("world from palm: w, x, y, z", ""),
    "palm_position_before": Quantity("one time step earlier, world", "length"),
    "palm_quaternion_before": Quantity("one time step earlier, world from palm: w, x, y, z", ""),
    "palm_position_between": Quantity("halfway between two knots, world", "length"),
    "palm_quaternion_between": Quantity("halfway between two knots, world from palm: w, x, y, z", ""),
    "palm_radius": Quantity("", "length"),
    "ground_height": Quantity("world", "length"),
    "up": Quantity("the ground's normal, palm frame", ""),
    "ground": Quantity("the ground's offset along its normal, palm frame", "length"),
    "clearance": Quantity("asked of object and palm", "length"),
    "margin": Quantity("clearance asked of bodies that need not touch", "length"),
    # Fingers.
    "link_radius": Quantity("of the links but the last", "length"),
    "radius": Quantity("of the links but the last", "length"),
    "tip_radius": Quantity("of the last link, which touches the object", "length"),
    "hinge": Quantity("from the last joint to where the body of its link begins", "length"),
    "servo_radius": Quantity("of the ball about a joint that holds its servo", "length"),
    "shortest": Quantity("link that is allowed", "length"),
    "shortest_last": Quantity("last link that is allowed", "length"),
    "longest": Quantity("link that is allowed", "length"),
    "lowest": Quantity("joint angle that is allowed", "rad"),
    "highest": Quantity("joint angle that is allowed", "rad"),
    "frames": Quantity(
        "of the joints: rotations (3, 3) by columns, the third the axis where its coordinates are 0", ""
    ),
    "target": Quantity("contact points to be followed, palm frame", "length"),
    "active": Quantity("1 where the contact acts, 0 where it does not", ""),
    "idle_step": Quantity("half the time between the keyframes around one in the air", "s"),
    "keyframe_step": Quantity("mean time between keyframes", "s"),
    # What a user's own terms read.
    "time": Quantity("of the samples", "s"),
    "unit_length": Quantity("the characteristic length", "m"),
    "unit_force": Quantity("the object's weight", "N"),
    # What costs hold a finger near to.
    "wanted_base": Quantity("where costs hold the finger's base near to", "length"),
    "wanted_lengths": Quantity("the links' lengths that costs hold near to", "length"),
    "wanted_axes": Quantity("the joints' axes that costs hold near to", "rad"),
    "wanted_bends": Quantity("the links' bends that costs hold near to", "rad"),
}


def quantities(names: Iterable[str], contacts: Sequence[str]) -> dict[str, Quantity]:
    """What variables and parameters of a stage are; what is not known is left out.

    Args:
        names: in the stage's problem.
        contacts: names of the fingers' contacts; a variable of one of them ends with its index.
    """
    found = {name: _quantity(name, contacts) for name in names}
    return {name: quantity for name, quantity in found.items() if quantity is not None}


def _quantity(name: str, contacts: Sequence[str]) -> Quantity | None:
    if name.startswith("weight."):
        return Quantity(f"weight of the term {name.removeprefix('weight.')}", "")
    if name.startswith("near."):
        of = _quantity(name.removeprefix("near."), contacts)
        return of and Quantity(f"where the proximal term is least: {of.about}", of.unit)
    plain = name if name in _QUANTITIES else name.removesuffix(_DISTURBED)
    kind = plain.rstrip("0123456789")
    found = _QUANTITIES.get(kind)
    if found is None or kind == plain or kind == "object":
        return found
    index = int(plain.removeprefix(kind))
    owner = f"finger '{contacts[index]}'" if index < len(contacts) else "the ground"
    return Quantity(f"{owner}: {found.about}", found.unit)
