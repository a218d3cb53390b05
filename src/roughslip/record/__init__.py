"""Measured friction records: the mean curve over speed and the scatter about it, with their errors.

    slid = sliding(read_records(["trace.csv"]), Rig(mass_kg=2.0, stiffness_n_per_m=800.0))
    found = fit_record(slid.samples, progress=print)
    law = found.curve.law()

- read_records: text of a tribometer, in one file or several
- sliding: samples of sliding, in slips of stick-slip by the balance of forces
- contact_memory: memory of the contact, from steps of speed and holds
- fit_record: mean curve and scatter, with drift, the period of a revolution and ramps that differ

`__init__.pyi` lists all public names and their modules.
"""

from roughslip.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
