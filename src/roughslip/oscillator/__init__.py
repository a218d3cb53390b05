"""A mass on a moving belt with stochastic friction: stick-slip motion, its limits, and statistics of its cycles.

    belt = Oscillator(mass_kg=1.0, natural_frequency_rad_per_s=316.0, damping_ratio=0.17,
                      belt_velocity_m_per_s=0.948, normal_force_n=2500.0)
    cycles = simulate(belt, StribeckLaw(0.3), duration_periods=100.0).cycles

- Oscillator, StribeckLaw, CoulombLaw, TableLaw: the system
- simulate, trajectory: its motion, with or without scatter, by MotionOptions; ensemble: many, over any parameters
- limit_cycle, hopf_damping, existence_limit, grazing_response: the cycle without scatter, its limits, and their shift
- answer: whether it stick-slips with ScatteringFriction, where that ends or begins, and why, by a Sampling of runs
- uncertainty_budget: how sure that is, and which uncertain input of a Machine decides it
- run_until_known, states_of: when it is in stick-slip and when in steady sliding
- durations, durations_by_theory: how long both last, by long runs and by the chain of a trough_map
- reattachment_statistics, count_difference: statistics of ensembles

`__init__.pyi` lists all public names and their modules.
"""

from roughslip.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
