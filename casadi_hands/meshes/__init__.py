"""Meshes that people give: read, mended, weighed, and cut into convex parts."""

from casadi_hands.meshes.mend import mend
from casadi_hands.meshes.mesh import Mesh, scaled
from casadi_hands.meshes.parts import Decomposition, convex_parts, told
from casadi_hands.meshes.read import read_mesh

__all__ = ["Decomposition", "Mesh", "convex_parts", "mend", "read_mesh", "scaled", "told"]
