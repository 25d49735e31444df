"""A shelf of candidate causes, one a file: what may be wrong with the simulation.

`MECHANISMS[name].extend(simulation)` adds one; the diagnosis tries them alone and together.
"""

from __future__ import annotations

from tsvision.mechanisms import (
    angle_scale,
    axial_stretch,
    backlash,
    bending_stiffness,
    camera_scale,
    coiling,
    creep,
    hole_distance,
    knot_absorption,
    lost_turns,
    radial_compression,
    radius_bias,
    radius_step,
    variable_radius,
    zone_length,
)
from tsvision.mechanisms.shelf import Mechanism, Parameter, Part, Shape, Simulation
from tsvision.mechanisms.state import Conditions

MECHANISMS: dict[str, Mechanism] = {
    module.MECHANISM.name: module.MECHANISM
    for module in (
        radius_bias,
        angle_scale,
        hole_distance,
        zone_length,
        lost_turns,
        axial_stretch,
        radial_compression,
        backlash,
        creep,
        radius_step,
        knot_absorption,
        camera_scale,
        coiling,
        variable_radius,
        bending_stiffness,
    )
}

__all__ = [
    "MECHANISMS",
    "Conditions",
    "Mechanism",
    "Parameter",
    "Part",
    "Shape",
    "Simulation",
]
