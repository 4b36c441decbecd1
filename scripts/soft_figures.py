"""Solve tasks by the thesis's own stages, without refinement, and print how exact the soft costs alone get.

    python scripts/soft_figures.py problems/horizontal_translation.yaml --seeds 0 1 2 3 4

Everything is measured on the files of the results, which stay in ``--out`` and are not solved again.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from apart import ended
from shared import NOTHING, SEEDS, joints_of, kept_solve, options_of, write_table
from tables import add_json, write_record

from casadi_hands.errors import DesignError
from casadi_hands.export.design import Design
from casadi_hands.verify.figures.clearance import penetration_figure
from casadi_hands.verify.figures.contact import Placements, active_contacts, surface_normals
from casadi_hands.verify.figures.dynamics import sample_residual, shoot
from casadi_hands.verify.figures.goals import goal_figures
from casadi_hands.verify.reading.folder import Folder, read_folder
from casadi_hands.verify.trajectory import build_trajectory, sample_placements

HEAD = (
    "task",
    "seed",
    "joints",
    "goals mm / deg",
    "contact from object mm",
    "contact from finger mm",
    "penetration mm",
    "slip of all contacts from sample to sample mm",
    "friction excess on object (m·g)",
    "residual force (m·g)",
    "residual torque (m·g·l)",
    "s in all",
)


def main() -> None:
    """Measure every task with every seed."""
    parser = options_of(__doc__)
    parser.add_argument("tasks", metavar="TASK", nargs="+", type=Path, help="task files")
    parser.add_argument("--seeds", nargs="+", type=int, default=list(SEEDS), help="seeds of the search")
    parser.add_argument("--out", type=Path, default=Path("results/measured"), help="folder for the results")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes")
    add_json(parser)
    given = parser.parse_args()
    rows = []
    for task in given.tasks:
        for seed in given.seeds:
            design, path = kept_solve(task, seed, "whole_hand", given.out, given.jobs)
            seconds = design.seconds.get("total")
            ends = [NOTHING if seconds is None else f"{seconds:.0f}"]
            rows.append([design.task.name, str(seed), joints_of(design), *figures_of(design, path), *ends])
            write_table(HEAD, rows, given.out / "soft.md")
            write_record(given.json, "soft_figures", HEAD, rows)


def figures_of(design: Design, path: Path) -> list[str]:
    """The figures between ``joints`` and the time in ``HEAD``; where there is nothing to measure, why, and dashes."""
    try:
        # What a solve that did not end by itself has left is not its result.
        if not ended(path):
            return soft_figures(read_folder(path))
    except DesignError:
        pass
    return [f"failed: {design.reason.split(';')[0]}", *[NOTHING] * (len(HEAD) - 5)]


def soft_figures(folder: Folder) -> list[str]:
    """What `figures_of` gives of a whole result: each figure is the worst over the motion."""
    placed, shots = sample_placements(folder), shoot(folder)
    goals = {figure.name: figure.value for figure in goal_figures(folder)}
    from_object, from_finger = contact_distances(folder, placed)
    penetration = penetration_figure(folder, build_trajectory(folder, shots)).value
    force, torque = sample_residual(folder, shots)
    return [
        f"{1e3 * goals['goal_position']:.2f} / {goals.get('goal_angle', np.nan):.2f}",
        f"{1e3 * from_object:.2f}",
        f"{1e3 * from_finger:.2f}",
        f"{1e3 * penetration:.2f}",
        f"{1e3 * sum(planned_slips(folder, placed).values()):.2f}",
        f"{friction_excess_on_object(folder, placed):.3f}",
        f"{force.max():.3f}",
        f"{torque.max():.3f}",
    ]


def contact_distances(folder: Folder, placed: Placements) -> tuple[float, float]:
    """Largest distance (m) of an active contact's two stored points from the object's and from the link's surface.

    The ground's contact is left out: it has no finger.
    """
    motion, from_object, from_finger = folder.motion, 0.0, 0.0
    for k, c in active_contacts(folder):
        link = motion.contact_link[c]
        if link == "ground":
            continue
        object_rotation, object_position = (each[k] for each in placed["object"])
        link_rotation, link_position = (each[k] for each in placed[link])
        for world in (
            object_rotation @ motion.contact_point_object[k, c] + object_position,
            link_rotation @ motion.contact_point_link[k, c] + link_position,
        ):
            in_object = object_rotation.T @ (world - object_position)
            in_link = link_rotation.T @ (world - link_position)
            from_object = max(from_object, abs(folder.object.surface_distance(in_object)))
            from_finger = max(from_finger, abs(folder.links[link].surface_distance(in_link)))
    return from_object, from_finger


def planned_slips(folder: Folder, placed: Placements) -> dict[str, float]:
    """How far each finger's contact is planned to slide from sample to sample, in all, m.

    The audit's slip lets physics move the object between samples; where a soft motion's forces nearly balance, a thin
    object still whirls there, and that slip would drown the planned one.
    """
    motion = folder.motion
    active = set(active_contacts(folder))
    slips: dict[str, float] = {}
    for c, name in enumerate(motion.contact_names):
        if (link := motion.contact_link[c]) == "ground":
            continue
        both = [k for k in range(len(motion.time) - 1) if {(k, c), (k + 1, c)} <= active]
        slips[name] = sum(_slid(folder, placed, link, c, k) for k in both)
    return slips


def _slid(folder: Folder, placed: Placements, link: str, c: int, k: int) -> float:
    """How much farther a contact travels on one of its two bodies than on the other from a sample to the next, m.

    The points that touch at either sample are carried to the other one; their mean cancels second-order errors.
    """
    motion = folder.motion

    def carried(body: str, point: np.ndarray) -> np.ndarray:
        before, after = (rotation @ point + position for rotation, position in (at(body, k), at(body, k + 1)))
        way: np.ndarray = after - before
        return way

    def at(body: str, sample: int) -> tuple[np.ndarray, np.ndarray]:
        rotations, positions = placed[body]
        return rotations[sample], positions[sample]

    ends = (k, k + 1)
    on_object = [carried("object", motion.contact_point_object[i, c]) for i in ends]
    on_link = [carried(link, motion.contact_point_link[i, c]) for i in ends]
    slid = (np.sum(on_object, axis=0) - np.sum(on_link, axis=0)) / 2
    normal = np.sum([surface_normals(folder, placed, i, c)[0] for i in ends], axis=0)
    normal /= np.linalg.norm(normal)
    return float(np.linalg.norm(slid - (slid @ normal) * normal))


def friction_excess_on_object(folder: Folder, placed: Placements) -> float:
    """Largest tangential force beyond friction times normal force on the object's surface, over the weight."""
    excess = -np.inf
    for k, c in active_contacts(folder):
        force, outward = folder.motion.contact_force[k, c], surface_normals(folder, placed, k, c)[0]
        normal = -float(force @ outward)
        tangential = float(np.linalg.norm(force + normal * outward))
        excess = max(excess, (tangential - folder.friction(c) * max(normal, 0.0)) / folder.weight)
    return excess


if __name__ == "__main__":
    main()
