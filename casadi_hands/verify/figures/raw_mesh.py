"""What decomposition into convex parts hides: gaps and overlaps of fingers and the mesh that the object was made of."""

from __future__ import annotations

import numpy as np

from casadi_hands.verify.bodies import Body, body_distance
from casadi_hands.verify.figures.contact import Placements
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.report import Figure, worse


def raw_mesh_figures(folder: Folder, placed: Placements) -> list[Figure]:
    """Return the largest gap or overlap at a contact, and the deepest overlap of a link, at samples, m.

    Both are of fingers' capsules and the object as it is seen: meshes before they were cut, and what else it is made
    of. Overlaps count to a capsule's axis. Nothing is asked of them; an object without meshes has none.
    """
    body, motion = folder.object, folder.motion
    if not body.raw:
        return []
    rest = Body("object", body.mass, body.center_of_mass, body.inertia, body.seen)
    gap, overlap = (0.0, "no contact is active"), (0.0, "no link overlaps the object's mesh")
    for name, link in folder.links.items():
        if not link.capsules:
            continue
        contacts = [c for c, other in enumerate(motion.contact_link) if other == name]
        for k, time in enumerate(motion.time):
            at = [(rotations[k], positions[k]) for rotations, positions in (placed["object"], placed[name])]
            distance = min(_from_mesh(body, at[0], link, at[1]), body_distance(rest, at[0], link, at[1]))
            words = f"{folder.call(name)} and the object's mesh overlap by {{value}} at {time:.3g} s"
            overlap = worse(overlap, (-distance, words))
            for c in contacts:
                if motion.contact_active[k, c]:
                    words = f"contact '{motion.contact_names[c]}' is {{value}} off the object's mesh at {time:.3g} s"
                    gap = worse(gap, (abs(distance), words))
    figures = {"gap_mesh": gap, "penetration_mesh": overlap}
    return [Figure(name, value, None, "m", words) for name, (value, words) in figures.items()]


def _from_mesh(
    body: Body, placed: tuple[np.ndarray, np.ndarray], link: Body, link_placed: tuple[np.ndarray, np.ndarray]
) -> float:
    """Return the distance of a link's capsules from the triangles that a body looks like, m; negative for overlaps."""
    turn, shift = placed[0].T @ link_placed[0], placed[0].T @ (link_placed[1] - placed[1])
    return min(
        mesh.distance(turn @ capsule.start + shift, turn @ capsule.end + shift) - capsule.radius
        for capsule in link.capsules
        for mesh in body.raw
    )
