"""Terms of one's own, for the README's task.yaml: the object goes low, and no finger presses with more than 1.2 N."""

import casadi as ca
import numpy as np

from casadi_hands import Bound, Cost, load_task, solve


def height(at):
    """Of the object above 28 cm, in cm."""
    return (at.position[2] - 0.28) / 0.01


def pressing(at):
    """Square of each finger's force, N²."""
    return [ca.sumsqr(force) for force in at.forces.values()]


if __name__ == "__main__":
    task = load_task("task.yaml")
    low = Cost("low", height, stage="floating", weight=5.0)
    gentle = Bound("gentle", pressing, stage="floating", upper=1.2**2)
    for terms in ((), (low, gentle)):
        design = solve(task, until="floating", terms=terms)
        motion = design.motion
        print(f"down to {motion.object_position[:, 2].min():.4f} m, at most", end=" ")
        print(f"{np.linalg.norm(motion.contact_force, axis=2).max():.2f} N, {design.costs['floating'].get('low')}")
