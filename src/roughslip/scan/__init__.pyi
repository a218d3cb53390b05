from roughslip.scan.covariance_fit import fitted_covariances as fitted_covariances
from roughslip.scan.instrument_file import read_scan as read_scan
from roughslip.scan.statistics import ScanStatistics as ScanStatistics
from roughslip.scan.statistics import scan_statistics as scan_statistics
from roughslip.scan.topography import Topography as Topography
from roughslip.scan.topography import remove_form as remove_form
