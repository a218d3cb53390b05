from roughslip.chaos.hermite import hermite_basis as hermite_basis
from roughslip.chaos.hermite import multi_indices as multi_indices
from roughslip.chaos.pressure import fit_in_contact as fit_in_contact
from roughslip.chaos.pressure import pressure_target as pressure_target
from roughslip.chaos.regression import least_squares as least_squares
from roughslip.chaos.variables import latin_hypercube as latin_hypercube
