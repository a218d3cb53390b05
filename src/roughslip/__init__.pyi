from roughslip.datasets import read as read
from roughslip.datasets import to_xarray as to_xarray
from roughslip.errors import ConvergenceError as ConvergenceError
from roughslip.errors import IllPosedError as IllPosedError
from roughslip.errors import InputError as InputError
from roughslip.errors import MissingPackageError as MissingPackageError
from roughslip.errors import ParameterError as ParameterError
from roughslip.errors import RoughslipError as RoughslipError
from roughslip.errors import StoreError as StoreError
from roughslip.grid import Grid as Grid

__version__: str
