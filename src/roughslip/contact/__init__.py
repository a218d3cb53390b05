"""Normal contact of a rough elastic or elastic-plastic half-space with a rigid plane.

    influence = Influence(grid, material.plane_strain_modulus_pa)
    solution = solve(influence, heights - plane)

- solve, sweep, solve_load: pressures and gaps for a fixed plane, several planes, or a given load
- Influence, Material: the matrix B of a mesh, free half-space or periodic cell; elastic constants
- relative_residual: how far pressures and gaps are from the conditions of contact
- closed_forms: contact problems with known answers
- far_field: effect of distant contacts along a strip

Numerical methods: dense_solver for few nodes, conjugate_gradients with nested meshes for many, convolution for B p.
"""

from roughslip.contact.influence import Influence, Material
from roughslip.contact.kernels import relative_residual
from roughslip.contact.solve import ContactSolution, solve, solve_load, sweep

__all__ = ["ContactSolution", "Influence", "Material", "relative_residual", "solve", "solve_load", "sweep"]
