"""Measured surfaces.

    scan = remove_form(read_scan(Path("disc.al3d")), "plane")
    found = scan_statistics(scan)

- read_scan, Topography, remove_form: files of instruments, heights on a mesh, removal of their form
- scan_statistics, fitted_covariances: statistics with intervals, and models for the scan

`__init__.pyi` lists all public names and their modules.
"""

from roughslip.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
