"""Do the fingertips bear the torsional moments that the plan states, and do these act against the spin?

A soft fingertip resists a twist about the contact's normal by at most ρ √(f_n² - f_t²/μ²): ρ the radius of its
torsional friction, f_n and f_t its normal and tangential force (the limit surface as an ellipse; Howe and Cutkosky,
1996). Where it turns on the object the moment is at that limit, against the turn.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.verify.figures.contact import Placements, active_contacts, surface_normals
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.report import Figure, worse
from casadi_hands.verify.trajectory import DENSITY, Trajectory

SPINNING = 0.8
"""rad/s: a contact that turns quicker on the object has all of its torsion against the turn."""
TURNING = 0.15
"""rad/s: one that turns quicker is not driven on by its moment."""
LEAST = 0.05
"""Of the weight: a limit below which nothing is asked of the moment."""
ALIGNED = 5e-3
"""rad that a moment may be off its normal, as where a contact passes from a capsule's side to its cap."""
UNBORNE = 1e-3
"""Of half the object's extent: the lever by which the moment of a hard point, which bears none, counts as a force."""


def torsion_figures(folder: Folder, placed: Placements, path: Trajectory) -> list[Figure]:
    """Return how far moments exceed their limits, how far they fall short of them where contacts spin, and their use.

    All moments are over ρ, so that they are forces, and these over the weight; the last two are shares of the limit.
    Where the file states none there are none. No figures of hard points without moments.
    """
    motion, limits = folder.motion, folder.task.limits
    if motion.contact_moment is None and not folder.task.fingertip.torsion:
        return []
    moments = np.zeros_like(motion.contact_force) if motion.contact_moment is None else motion.contact_moment
    excess, use = (0.0, "no contact bears a moment beyond its limit"), (0.0, "no contact that rests bears a moment")
    most, about = np.zeros(motion.contact_active.shape), np.zeros(motion.contact_active.shape)
    for k, c in active_contacts(folder):
        normal = surface_normals(folder, placed, k, c)[0]
        moment, soft = moments[k, c], tip_radius(folder, c)
        if soft:
            most[k, c] = most_torsion(motion.contact_force[k, c], normal, folder.friction(c))
            about[k, c] = float(moment @ normal) / soft
        off = float(np.linalg.norm(moment - about[k, c] * soft * normal)) - ALIGNED * abs(about[k, c]) * soft
        over = abs(about[k, c]) - most[k, c] + max(off, 0.0) / (soft or UNBORNE * folder.length)
        at = f"contact '{motion.contact_names[c]}' at {motion.time[k]:.3g} s"
        excess = worse(excess, (over / folder.weight, f"a moment exceeds what the tip bears by {{value}}, at {at}"))
    stray = np.abs(moments[~motion.contact_active]).max(initial=0.0)
    excess = worse(
        excess, (float(stray) / (folder.weight * folder.length), "a contact that is not active has a moment")
    )
    short = (0.0, "no moment falls short of a spin or drives it")
    for contact, name in enumerate(motion.contact_names):
        if motion.contact_link[contact] == "ground":
            continue
        spins = spin_rates(folder, path, contact)
        for k in map(int, np.flatnonzero(motion.contact_active[:-1, contact])):
            limit, moment = (float(values[k : k + 2, contact].mean()) for values in (most, about))
            where = f"contact '{name}' at {motion.time[k]:.3g} s"
            if limit < LEAST * folder.weight:
                continue
            along = float(moment / limit * np.sign(spins[k]))
            if abs(spins[k]) > SPINNING:
                words = f"the moment of {where}, which spins, is {{value}} off its limit against the spin"
                short = worse(short, (abs(along + 1.0), words))
            elif abs(spins[k]) > TURNING:
                short = worse(short, (along, f"the moment of {where} drives its spin with {{value}} of its limit"))
            elif abs(spins[k]) < SPINNING / 10:
                use = worse(use, (abs(moment) / limit, f"{{value}} of the torsional friction is counted on at {where}"))
    return [
        Figure("torsion_excess", excess[0], limits.torsion_excess, "weight", excess[1]),
        Figure("torsion_shortfall", short[0], limits.torsion_shortfall, "share", short[1]),
        Figure("torsion_use", use[0], None, "share", use[1]),
    ]


def tip_radius(folder: Folder, contact: int) -> float:
    """Return the radius of a contact's torsional friction, m; 0 of the ground's."""
    return 0.0 if folder.motion.contact_link[contact] == "ground" else float(folder.task.fingertip.torsion)


def most_torsion(force: np.ndarray, outward: np.ndarray, friction: float) -> float:
    """Return the largest moment that a soft tip bears beside its force (3,), over the radius of its torsion, N.

    Args:
        force: on the object, N.
        outward: (3,) unit normal of the object, same frame.
        friction: of sliding.
    """
    pressing = max(-float(force @ outward), 0.0)
    across = float(np.linalg.norm(force - (force @ outward) * outward)) / friction
    return float(np.sqrt(max(pressing**2 - across**2, 0.0)))


def spin_rates(folder: Folder, path: Trajectory, contact: int) -> np.ndarray:
    """Return how fast (S - 1,) the object turns against what it touches, rad/s, about its outward normal."""
    motion = folder.motion
    ends = np.arange(0, len(path.time), DENSITY)
    ours, theirs = (path.placed[body][0][ends] for body in ("object", motion.contact_link[contact]))
    relative = Rotation.from_matrix(np.einsum("sba,sbc->sac", theirs, ours))
    turned = (relative[:-1].inv() * relative[1:]).as_rotvec()
    normals = np.array([folder.object.normal(point) for point in motion.contact_point_object[:-1, contact]])
    rates: np.ndarray = np.sum(turned * normals, axis=1) / np.diff(motion.time)
    return rates
