"""Normal contact of a rough elastic or elastic-plastic half-space with a rigid plane.

    influence = Influence(grid, material.plane_strain_modulus_pa)
    solution = solve(influence, heights - plane)

- solve, solve_load: pressures and gaps at a plane, a penetration or a load; sweep, solve_loads: lists, at several
- Influence, Material: the matrix B of a mesh, free half-space or periodic cell; elastic constants
- contact_shares: the contact area, less the error of the mesh
- cell_heights: heights that give a mesh of a periodic cell the pressures of a smooth surface
- point_pressures: pressures at nodes, less that error

`__init__.pyi` lists all public names and their modules. Numerical methods: dense_solver for few nodes,
conjugate_gradients with nested meshes for many, convolution for B p.
"""

from roughslip.contact.solve import solve  # noqa: F401 - at once, because its module has the same name
from roughslip.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
