"""The shapes of bodies, one class a module; each is found by its place in this folder."""

import math
from importlib import import_module
from pkgutil import iter_modules

from casadi_hands.geometry.bodies.body import Body, Solid, Surface, packed, surfaces, width_of
from casadi_hands.geometry.core import Core

for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")

# By their names in task files: the simplest first, last those of any number of parameters.
KINDS: dict[str, type[Body]] = {
    kind.kind: kind for kind in sorted(Body.__subclasses__(), key=lambda k: getattr(k, "width", math.inf))
}

__all__ = ["KINDS", "Body", "Core", "Solid", "Surface", "packed", "surfaces", "width_of"]
