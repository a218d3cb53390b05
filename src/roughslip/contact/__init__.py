"""Normal contact of a rough elastic half-space with a rigid plane.

material : elastic constants
influence : Love's influence matrix B, as coefficients, dense submatrix and FFT product
dense : direct solver for up to about a thousand nodes
conjugate_gradients : iterative solver for large meshes
residual : how well a solution fulfils the contact conditions
solve : one plane, or a sweep of planes over one surface; chooses the solver
"""
