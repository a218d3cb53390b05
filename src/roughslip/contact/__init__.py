"""Normal contact of a rough elastic or elastic-plastic half-space with a rigid plane.

solve : a given plane, a given load, or a sweep of planes over one surface; chooses the method
material : elastic constants
influence : the influence matrix B, free (Love) or periodic (periodic), as coefficients, dense submatrix and products
convolution : products by pruned transforms
dense : block pivoting for few nodes
conjugate_gradients : for large meshes; plane or load, cap, free or periodic
fields : its compiled passes
nested : where it starts
residual : how well a solution fulfils the contact conditions
closed_forms : solutions known on paper, which verify all this
"""
