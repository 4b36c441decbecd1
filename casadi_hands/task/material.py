"""What links are made of, and what the hinges between them bear."""

from __future__ import annotations

from typing import Any

from pydantic import Field, SerializerFunctionWrapHandler, field_validator, model_serializer, model_validator

from casadi_hands.task.fields import Positive, Section, refuse

_SOFTEST, _WEAKEST = 1e6, 1e4  # Pa, of a rubber; below, a file is in GPa or MPa


class Material(Section):
    """What links are made of: a name (PLA, PETG, ABS, PA12, aluminium-6061), or a mapping of these."""

    density: Positive = Field(description="kg/m³.")
    stiffness: Positive = Field(description="Young's modulus, Pa.")
    strength: Positive = Field(description="Stress that it bears in bending, Pa; of a print, across its layers.")

    @model_validator(mode="before")
    @classmethod
    def _of_name(cls, value: Any) -> Any:
        if not isinstance(value, str):
            return value
        if value not in MATERIALS:
            raise refuse(f"{', '.join(MATERIALS)}, or {{density, stiffness, strength}} in kg/m³ and Pa")
        return MATERIALS[value].__dict__

    @field_validator("stiffness", "strength")
    @classmethod
    def _in_pascals(cls, value: float, info: Any) -> float:
        least = _SOFTEST if info.field_name == "stiffness" else _WEAKEST
        if value < least:
            raise refuse(f"Pa, {least:g} and more; is this one in MPa or GPa?")
        return value

    @model_serializer(mode="wrap")
    def _named(self, handler: SerializerFunctionWrapHandler) -> Any:
        return next((name for name, known in MATERIALS.items() if known == self), None) or handler(self)


MATERIALS: dict[str, Material] = {
    # Printed, solid. Stiffness and strength are those of bars that stood upright in the printer, so across the layers:
    # how links will lie in it is not known, and along the layers all of these bear more.
    # Stratasys, "PLA" data sheet: upright 26 MPa and 2.54 GPa, on edge 45 MPa and 3.04 GPa; density as of most brands.
    "PLA": Material(density=1240.0, stiffness=2.5e9, strength=26e6),
    # additive.tools/materials/petg: 25 to 38 MPa upright, 2 to 3 GPa, 1.25 to 1.29 g/cm³.
    "PETG": Material(density=1270.0, stiffness=2.0e9, strength=25e6),
    # Stratasys, "ABS-M30" data sheet: upright 28 MPa and 2.2 GPa, specific gravity 1.04.
    "ABS": Material(density=1040.0, stiffness=2.2e9, strength=28e6),
    # Laser-sintered, much the same in all directions. EOS PA 2200 and additive.tools/materials/pa12: 44 to 52 MPa,
    # 1.65 GPa, 0.93 g/cm³.
    "PA12": Material(density=930.0, stiffness=1.65e9, strength=44e6),
    # Temper T6, milled: least yield strength by EN 755-2, 240 MPa; modulus and density by ASM's handbook.
    "aluminium-6061": Material(density=2700.0, stiffness=68.9e9, strength=240e6),
}
"""By name."""
DEFAULT_MATERIAL = "PLA"

SAFETY = 2.0
"""Of a material's strength over the largest planned stress: prints scatter, and bumps are not in the plan."""

# The hinge that counts is as wide as a link is thick, 2 r: a tongue of one link between two cheeks of the other, cut
# from its round end, on a pin of half its radius. With a tongue of 1.15 r and cheeks of 0.425 r, with pressure p,
# - the tongue's bore, pressed evenly, bears a moment across the pin of p d b²/4 = 0.165 p r³, and a force of 0.57 p r²;
# - the cheeks, bent about their roots a radius away, bear 0.169 p r³ and 0.215 p r²; their bores more.
# A moment may use 4/5 of the sixth, a force 1/5 of the fifth, so that the hinge bears both at once.
_MOMENT, _FORCE = 4 / 5 / 6, 1 / 5 / 5
# The pin is then bent with 3 times that pressure; steel for pins yields at 500 MPa.
_PIN_STRENGTH = 500e6 / 3


def hinge_loads(material: Material, safety: float, radius: float) -> tuple[float, float]:
    """Force (N) and moment across the axis (N·m) that a hinge with a steel pin bears, both at once.

    Args:
        material: of both links.
        safety: factor of it.
        radius: of the links, m.
    """
    pressure = min(material.strength, _PIN_STRENGTH) / safety
    return _FORCE * pressure * radius**2, _MOMENT * pressure * radius**3
