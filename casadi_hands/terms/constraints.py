"""What the stages constrain: each with its equation, its unit, and what to say where a solve violates it.

Lengths are in units of the characteristic length, forces in m·g. ``explains`` names figures of the audit that follow.
"""

from __future__ import annotations

from dataclasses import replace

from casadi_hands.declared import Constraint

_JOINTS = "more joints (search.max_joints)"
_REACH = f"{_JOINTS} or a contact on the palm's side of the object"
_ROOM = "thinner links (hand.link_radius), a palm farther away or contacts farther apart"
_HOLDING = "more friction or contacts that oppose each other better"
_TORQUE = "stronger motors (actuator.torque), a lighter object or more friction"
_SIDE = f"{_JOINTS} or a contact that is pressed from another side"
_PACE = "slower goals, more friction or more fingers"
_DISTURBED = "weaker perturbations, more friction or more fingers"
_BALANCE, _GAP = ("residual", "residual_between"), ("gap", "gap_between")

# The soft stages'.
IN_CONE = Constraint("in_cone", "eq. 2.8 as a bound", "force")
ENOUGH_CONTACTS = Constraint("sum", "section 2.2.1")

# The object's motion.
DEFECT = Constraint(
    "defect", "Newton–Euler from knot to knot", "", "be moved as planned by the forces of its contacts", _PACE, _BALANCE
)
ON_JOINT = Constraint(
    "on_joint", "the joint's pose and velocity", "", "stay on the joint that holds it", _PACE, _BALANCE
)
WRENCH_OF_CONTACTS = replace(DEFECT, name="sum", equation="eq. 2.5 and 2.6: the contacts' wrench")
TORSION_OF_CONTACTS = replace(DEFECT, name="torsion", equation="eq. 2.5: the torsion of all contacts")
EQUILIBRIUM = Constraint("sum", "rest without a jolt", "", "be held still at the start and the end", _PACE, _BALANCE)
DISTURBED_WRENCH = Constraint(
    "sum",
    "eq. 2.5 and 2.6 under a disturbance",
    "",
    "stay on its path under the perturbation",
    _DISTURBED,
    ("disturbance_radius",),
)
CLEAR_OF_PALM = Constraint(
    "palm", "section 3.2.3", "length", "stay clear of the palm", "goals farther from the palm", ("penetration",)
)
ABOVE_GROUND = Constraint(
    "ground", "section 3.1", "length", "stay above the ground", "goals above the ground", ("penetration",)
)
ON_PATH = Constraint("on_path", "fig. 3.4", "length", "draw its path", _PACE, ("goal_position",))

# A finger's shape.
AXIS_FROM_LINK = Constraint(
    "from_link", "squared cosine of axis and link", "", "be built with hinges", "a wider range in hand.axes.from_link"
)
BENT = Constraint("bent", "squared angle of the bend", "rad²", "be bent no further", "a larger hand.bend")

# What a finger bears, each as a square over its limit's.
_THICKER = "thicker or shorter links (hand.link_radius, hand.link_length) or a stronger material (hand.material)"
BEARING = Constraint(
    "bearing", "moment across a joint's axis", "", "grip so with its bearings", _THICKER, ("bearing_moment",)
)
STRESS = Constraint("stress", "√(σ² + 3 τ²) in a link", "", "grip so with its links", _THICKER, ("link_stress",))
DEFLECTION = Constraint(
    "deflection", "∫ M/(E I) s ds", "", "grip so without bending away", _THICKER, ("tip_deflection",)
)

# A finger's contact.
ON_OBJECT = Constraint(
    "on_object", "eq. 2.10 as an equation", "length", "stay on the object's surface", _REACH, (*_GAP, *_BALANCE, "slip")
)
ON_FACE = Constraint(
    "on_face",
    "how far a contact is from the edges of its face",
    "length",
    "stay off the edges of the face that it is on",
    "a contact farther from the edges, a smaller fingertip (fingertip.radius) or a smaller turn of the object",
    (*_BALANCE, "friction_excess", "torsion_excess", "slip"),
)
ON_LINK = Constraint(
    "on_link", "eq. 2.19 as an equation", "length", "reach its contact", _REACH, (*_GAP, *_BALANCE, "slip")
)
SINGULARITY_MARGIN = Constraint(
    "singularity_margin",
    "singularity margin",
    "",
    "follow without being stretched out or folded",
    _REACH,
    (*_GAP, "slip"),
)
PRESSING = Constraint(
    "pressing", "lower bound on the normal force", "force", "press firmly enough", _HOLDING, ("pull",)
)
CONE = Constraint(
    "cone", "eq. 2.8: (μ f_n)² - f_t²", "", "press without slipping", _HOLDING, ("friction_excess", "slip")
)
ACTUATED = Constraint(
    "structural",
    "eq. 2.23: force borne by the structure",
    "force",
    "supply its force with its joints",
    _SIDE,
    ("unsupplied_force",),
)
WITHIN_TORQUE = Constraint(
    "torque",
    "eq. 2.24 as a bound",
    "torque",
    "supply its force within the torque limit",
    _TORQUE,
    ("torque", "unsupplied_force"),
)
NO_SLIP = Constraint(
    "no_slip",
    "eq. 2.12 as an equation: both paths agree",
    "length",
    "roll with the object",
    f"{_JOINTS} or a smaller turn of the object",
    ("slip", *_GAP, *_BALANCE),
)

SPIN_RATE = Constraint(
    "spin_rate",
    "the turn of object against fingertip about the contact's normal",
    "speed",
    "turn with the object",
    _PACE,
    (*_GAP, "slip"),
)
TORSION_CONE = Constraint(
    "torsion_cone",
    "(f_t / μ)² + t² <= f_n²",
    "",
    "hold against a twist and a pull at once",
    _HOLDING,
    ("torsion_excess",),
)
TORSION_LAW = Constraint(
    "torsion_law",
    "torsion at its limit against the spin, where the contact spins",
    "force",
    "resist a twist as its tip does",
    "a harder fingertip (fingertip.torsion: 0), or more joints (search.max_joints)",
    ("torsion_shortfall", *_BALANCE),
)

SLIP_RATE = Constraint("slip_rate", "eq. 2.12: how fast the contact slides", "", "slide as planned", _PACE, _GAP)
SLIDING_LAW = Constraint(
    "law",
    "f_t = μ f_n (φ + (1 - φ²) free part), φ which way the contact slides",
    "force",
    "slide with friction on its cone",
    f"{_JOINTS}, or more friction",
    ("slide_shortfall", "slip", *_BALANCE),
)
STICKING = Constraint(
    "sticking",
    "eq. 2.8: friction in use where the contact rests",
    "",
    "hold where it rests",
    _HOLDING,
    ("slide_shortfall",),
)
WITHIN_SLIP = Constraint(
    "path",
    "section 3.3.3: how far the contact slides from touch to lift",
    "length",
    "keep its slide within limits.slip",
    f"{_JOINTS}, or limits.slip as wide as you can accept",
    ("slip",),
)

ON_LINES = Constraint(
    "on_lines",
    "q + τ / k = q₀ + C s",
    "angle",
    "be turned by so few motors",
    "more motors (motors), or wider ratios (hand.ratios)",
    ("coupling",),
)

# The same under a disturbance.
DISTURBED_PRESSING = replace(PRESSING, cannot="keep pressing under the perturbation", advice=_DISTURBED, explains=())
DISTURBED_CONE = replace(CONE, cannot="hold without slipping under the perturbation", advice=_DISTURBED, explains=())
DISTURBED_ACTUATED = replace(ACTUATED, cannot="supply its force under the perturbation", explains=())
DISTURBED_TORQUE = replace(WITHIN_TORQUE, cannot="supply its force under the perturbation", explains=())

# The ground's contact.
_GROUND = Constraint(
    "",
    "section 3.1",
    "",
    "rest on the ground as planned",
    "goals at which it stands on the ground, or a rougher one",
    (*_GAP, "slip"),
)
ON_SURFACES, OPPOSED, FACING = (replace(_GROUND, name=name) for name in ("on_surfaces", "opposed", "facing"))
GROUND_PRESSING, GROUND_CONE = (replace(_GROUND, name=name) for name in ("pressing", "cone"))
DISTURBED_GROUND_PRESSING = replace(
    PRESSING, cannot="stay pressed on the ground under the perturbation", advice=_DISTURBED, explains=()
)
DISTURBED_GROUND_CONE = replace(
    CONE, cannot="stand on the ground without slipping under the perturbation", advice=_DISTURBED, explains=()
)
GROUND_NO_SLIP = replace(
    NO_SLIP,
    cannot="stand on the ground without slipping",
    advice="a rougher ground (ground.friction)",
    explains=(*_GAP, "slip"),
)

# A finger.
UNFOLDED = Constraint(
    "unfolded", "neighbouring links' sharpest fold", "length", "keep its links off each other", _ROOM, ("penetration",)
)
CLEAR = Constraint("clear", "eq. 2.20 as a bound", "length", "stay clear of the other bodies", _ROOM, ("penetration",))
CLEAR_OF_EACH_OTHER = replace(CLEAR, cannot="stay clear of each other")
WITHIN_SPEED = Constraint(
    "speed",
    "the actuator's limit",
    "speed",
    "keep within the joints' speed limit",
    "faster motors (actuator.speed) or slower goals",
    ("speed",),
)
ON_PALM = Constraint("on_palm", "eq. 2.25 as a bound", "", "start on the palm", "a larger palm (palm.radius)")

# Motors that share joints.
MOTOR_TORQUE = replace(
    WITHIN_TORQUE,
    cannot="be turned within the motors' torque limit",
    advice="stronger motors (actuator.torque), more of them (motors), or a lighter object",
)
MOTOR_SPEED = replace(WITHIN_SPEED, cannot="be turned within the motors' speed limit")
