"""The sizes that the task has for a link: a finger's last one, which touches the object, has the fingertip's."""

from __future__ import annotations

from casadi_hands.verify.reading.folder import Folder


def radius_of(folder: Folder, link: str) -> float:
    """Return the radius, m, that the task has for a link: the fingertip's for one that carries no other."""
    carries = any(joint.parent == link for joint in folder.joints.values())
    return float(folder.task.hand.link_radius if carries else folder.task.fingertip.radius)


def hinge_of(folder: Folder, link: str) -> float:
    """Return how far from its joint, m, the task has a link's body begin: as many radii for thick ones as for thin."""
    hand = folder.task.hand
    return float(hand.hinge_length) * radius_of(folder, link) / float(hand.link_radius)


def shortest_of(folder: Folder, link: str) -> float:
    """Return the shortest, m, that the task allows a link to be: beyond its hinge all have as long a body at least."""
    hand = folder.task.hand
    return float(hand.link_length[0]) - float(hand.hinge_length) + hinge_of(folder, link)
