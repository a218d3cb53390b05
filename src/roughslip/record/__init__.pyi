from roughslip.record.result import FrictionCurve as FrictionCurve
from roughslip.record.result import FrictionScatter as FrictionScatter
