"""Measured surfaces.

read_scan, write_x3p : files of instruments, netCDF maps and matrices
Topography, remove_form : heights on a mesh, and removal of their form

Modules: statistics with intervals, autocorrelation and spectrum, covariance_fit, grinding for made scans.
"""

from roughslip.scan.instrument_file import read_scan, write_x3p
from roughslip.scan.topography import Topography, remove_form

__all__ = ["Topography", "read_scan", "remove_form", "write_x3p"]
