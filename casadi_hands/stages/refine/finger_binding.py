"""The fingers' blocks of the refine stage, bound to its knots."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from casadi_hands.geometry.bodies import Body
from casadi_hands.kinematics.singularity import MARGIN_SIZES
from casadi_hands.nlp import Parameter, Rows
from casadi_hands.problem.model import Model
from casadi_hands.stages.buildable import buildable, buildable_bounds
from casadi_hands.stages.refine import finger_kernels as kernels
from casadi_hands.stages.refine.declaration import FREE, IN_CONE, Bounds, Declaration, Knots

Array = NDArray[np.float64]
_SEAM = 1e-3  # lengths that bodies may be apart whose faces go on in one another
LIFTED, RISING = 0.06, 0.2  # lengths that a finger which has let go stays off the object, and lengths/s until it does


def bind_contact(of: Declaration, i: int) -> None:
    """A finger's contact: on both surfaces, in its cone, actuated, also under the task's disturbances."""
    structure = of.structure
    c, n, torque = structure.contacts[i], structure.joints[i], structure.model.joint_torque_limit
    kind = type(structure.model.touched[c])
    point, force = (rows.entries(3 * i, 3 * i + 3, c) for rows in (of.point, of.force))
    # The torque is bound only where the task limits it.
    actuated = {**IN_CONE, "structural": FREE, "torque": (-torque, torque)}
    limited = bool(np.isfinite(torque))
    touching = np.flatnonzero(structure.touching[:, i])
    names = ("frames", "tie", "wanted_point", "wanted_force", *(["margin_direction"] if n in MARGIN_SIZES else []))
    of.bind(
        touching,
        kernels.contact(n, kind, limited),
        {"on_object": (0.0, 0.0), "on_link": (0.0, 0.0), "singularity_margin": FREE, **actuated},
        (c,),
        f"contact{c}",
        **shape_at(of, i, touching),
        pose=of.pose.take(touching),
        point=point.take(touching),
        force=force.take(touching),
        angles=of.angles[i].take(touching),
        friction=of.problem["cone_friction" if structure.model.sliding else "friction"],
        **of.scene(c, touching),
        **of.of(c, touching, *names),
    )
    _bind_disturbed(of, i, actuated, limited)


def _bind_disturbed(of: Declaration, i: int, actuated: Bounds, limited: bool) -> None:
    """The same contact's force where a disturbance acts."""
    structure = of.structure
    c, n = structure.contacts[i], structure.joints[i]
    kind, point = type(structure.model.touched[c]), of.point.entries(3 * i, 3 * i + 3, c)
    disturbed = np.flatnonzero(structure.active[of.disturbed, i])
    if len(disturbed):
        knots = of.disturbed[disturbed]
        of.bind(
            knots,
            kernels.disturbed_contact(n, kind, limited),
            actuated,
            (c,),
            f"disturbed_contact{c}",
            **shape_at(of, i, knots),
            pose=of.pose.take(knots),
            point=point.take(knots),
            angles=of.angles[i].take(knots),
            force=of.force_disturbed.take(disturbed).entries(3 * i, 3 * i + 3, c),
            friction=of.problem["friction"],
            **of.scene(c, knots),
            **of.of(c, knots, "frames"),
        )


def bind_rolling(of: Declaration, i: int) -> None:
    """A finger's contact from knot to knot: it rolls, and its force is actuated halfway, too."""
    structure = of.structure
    c, n = structure.contacts[i], structure.joints[i]
    kind = type(structure.model.touched[c])
    point, force = (rows.entries(3 * i, 3 * i + 3, c) for rows in (of.point, of.force))
    start = np.flatnonzero(structure.active[:-1, i])
    scenes = of.scene(c, start), of.scene(c, start + 1)
    of.bind(
        start,
        kernels.rolling(n, kind, bool(structure.model.torsion), bool(structure.model.sliding)),
        {"no_slip": FREE, "slip_rate": (0.0, 0.0), "spin_rate": (0.0, 0.0)},
        (c,),
        f"rolling{c}",
        **shape_at(of, i, start),
        **{
            name: (rows.take(start), rows.take(start + 1))
            for name, rows in (("pose", of.pose), ("point", point), ("angles", of.angles[i]))
        },
        **{name: (scenes[0][name], scenes[1][name]) for name in scenes[0]},
        **({"slip": of.slip.take(start).entries(2 * i, 2 * i + 2, c)} if structure.model.sliding else {}),
        **({"spin": of.spin.take(start).entries(i, i + 1, c)} if structure.model.torsion else {}),
        **of.at(start, "step"),
        **of.of(c, start, "frames", "helper"),
    )
    # Else a finger may be stretched out between knots, or folded, and find itself there on more of them.
    halves = structure.middles.weights(start)
    of.bind(
        start,
        kernels.actuated(n, kind),
        {"structural": FREE},
        (c,),
        f"inter_knot{c}",
        **shape_at(of, i, start),
        pose=of.pose.combine(halves),
        point=point.combine(halves),
        angles=of.angles[i].combine(halves),
        force=force.combine(halves),
        **of.at(start, "reference", "radius", "tip_radius", "hinge"),
        **of.between(start),
        **of.of(c, start, "frames", "body"),
    )


def shape_at(of: Declaration, i: int, knots: Knots) -> dict[str, Rows]:
    """A finger's morphology, the same at all knots."""
    return {name: rows.constant(len(knots)) for name, rows in of.shape[i].items()}


def _radii(model: Model) -> tuple[str, ...]:
    """Parameters of what is kept clear: links, and servos in the joints if there are any."""
    return ("radius", "tip_radius", *(("servo_radius",) if model.servo else ()))


def bind_clearance(of: Declaration, i: int) -> None:
    """A finger clear of palm, ground, itself and the object, but for what its last link touches."""
    structure, model = of.structure, of.structure.model
    c, n = structure.contacts[i], structure.joints[i]
    touched = model.contact_table[c].body
    touching, idle = structure.touching[:, i], np.flatnonzero(~structure.active[:-1, i])

    def bind(
        kind: str,
        knots: Knots,
        moving: dict[str, Rows],
        palm: dict[str, Parameter],
        least: float,
        skipped: int | None,
        lifted: Array | None = None,
    ) -> None:
        kernel = kernels.apart(n, model.kinds, skipped, model.ground is not None, bool(model.servo))
        lower = np.full((len(knots), kernel.constraints["clear"].numel()), least)
        # Last of all are the last link's distances from the object's bodies, but for the one that it touches.
        if lifted is not None:
            lower[:, -len(model.kinds) :] += lifted[:, None]
        if skipped is not None:
            others = [k for k in range(len(model.kinds)) if k != skipped]
            adjoining = [_go_on(model.bodies[skipped], model.bodies[k]) for k in others]
            lower[:, lower.shape[1] - len(others) :][:, adjoining] = 0.0
        of.bind(
            knots,
            kernel,
            {"clear": (lower, np.inf), "unfolded": (0.0, np.inf)},
            (c,),
            f"{kind}{c}",
            **shape_at(of, i, knots),
            **moving,
            **palm,
            **of.at(knots, "reference", "palm_radius", "ground_height", "bodies", *_radii(model)),
            **of.of(c, knots, "frames"),
        )

    away = lifted_clearance(touching, model.schedule.samples)
    for kind, where, skipped in (("apart_touching", touching, touched), ("apart", ~touching, None)):
        knots = np.flatnonzero(where)
        if len(knots):
            moving = {"pose": of.pose.take(knots), "angles": of.angles[i].take(knots)}
            palm, lifted = of.at(knots, "palm_position", "palm_quaternion"), away[knots] if skipped is None else None
            bind(kind, knots, moving, palm, model.clearance, skipped, lifted)
    if len(idle):  # a lifted finger is quick, and must not cut through the object's edge between two knots
        halves = structure.middles.weights(idle)
        moving = {"pose": of.pose.combine(halves), "angles": of.angles[i].combine(halves)}
        bind("apart_between", idle, moving, of.between(idle), 0.0, None)


def _go_on(one: Body, other: Body) -> bool:
    """Whether the faces of one body may go on in another's, as those of a mesh's parts do.

    Next to the seam what touches one is as near to the other as it can be.
    """
    if not (one.face_bounds and other.face_bounds):
        return False
    (low, high), (lower, upper) = one.bounding_box, other.bounding_box
    return bool(np.all(low <= upper + _SEAM) and np.all(lower <= high + _SEAM))


def lifted_clearance(touching: NDArray[np.bool_], times: Array) -> Array:
    """How much farther (S,) from the object than others a finger stays that touches it at some times (S,), lengths.

    An object held by the others alone gives way a little, and must not be met by the finger that goes around it.
    """
    if not touching.any():
        return np.full(len(times), LIFTED)
    return np.asarray(np.minimum(RISING * np.abs(times[:, None] - times[touching]).min(axis=1), LIFTED))


def bind_shape(of: Declaration, i: int) -> None:
    """A finger's morphology, and its joints' motion: mirrored at both ends, so that it starts and ends at rest."""
    problem, structure, model, count = of.problem, of.structure, of.structure.model, of.knots
    c, n, speed = structure.contacts[i], structure.joints[i], model.joint_speed_limit
    inner = np.arange(-1, count + 1)
    mirrored = np.where(inner < 0, 1, np.where(inner >= count, count - 2, inner))
    three = [of.angles[i].take(mirrored[offset : offset + count]) for offset in range(3)]
    steps = of.steps(*(np.clip(np.arange(count) - back, 0, count - 2) for back in (1, 0)))
    kernel, limits = kernels.joint_motion(n, bool(np.isfinite(speed))), {"speed": (-speed, speed)}
    of.bind(np.arange(count), kernel, limits, (c,), f"joint_motion{c}", angles=three, step=steps)
    switches = np.flatnonzero(np.diff(structure.active[:, i].astype(int))) + 1
    first = np.array([k for k in range(count - 3) if k + 1 not in switches and k + 2 not in switches], int)
    four = [of.angles[i].take(first + offset) for offset in range(4)]
    problem.bind(kernels.joint_jerk(n), angles=four, step=of.steps(first, first + 1, first + 2))
    wanted = of.of(c, first, *[f"wanted_{name}" for name in of.shape[i]])
    reach = (model.palm_radius - model.radii(n)[0]) ** 2
    of.bind(None, kernels.near_design(n), {"on_palm": (0, reach)}, (c,), f"near_design{c}", **of.shape[i], **wanted)
    if model.hinged or model.bend:
        shape = {name: of.shape[i][name] for name in ("axes", "bends")} | {"frames": problem[f"frames{c}"]}
        kernel = buildable(n, model.hinged, bool(model.bend))
        of.bind(None, kernel, buildable_bounds(model), (c,), f"buildable{c}", **shape)


def bind_pair(of: Declaration, i: int, j: int, guarded: bool) -> None:
    """Two fingers clear of each other; ``guarded``: between knots, too."""
    structure = of.structure
    c, d = structure.contacts[i], structure.contacts[j]

    def bind(kind: str, knots: Knots, angles: list[Rows], least: float) -> None:
        shapes = shape_at(of, i, knots), shape_at(of, j, knots)
        of.bind(
            knots,
            kernels.fingers_apart(structure.joints[i], structure.joints[j], bool(structure.model.servo)),
            {"clear": (least, np.inf)},
            (c, d),
            f"{kind}{c}_{d}",
            **{name: (shapes[0][name], shapes[1][name]) for name in shapes[0]},
            angles=angles,
            frames=(of.problem[f"frames{c}"], of.problem[f"frames{d}"]),
            **of.problem.given(*_radii(structure.model)),
        )

    bind("fingers_apart", np.arange(of.knots), [of.angles[k] for k in (i, j)], structure.model.clearance)
    if guarded:
        inner = structure.inner
        bind("fingers_between", inner.interval, [of.angles[k].combine(inner.weights()) for k in (i, j)], 0.0)
