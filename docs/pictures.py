"""The style of the pictures in the manual: one panel a picture, side by side, or below each other on a phone.

Other pages than tutorials start with `from pictures import panel`. Pictures are SVG: sharp at any size, on paper too.
"""

import matplotlib as mpl
import matplotlib.pyplot as plt
import seaborn as sns
from matplotlib.axes import Axes
from matplotlib_inline.backend_inline import set_matplotlib_formats

from roughslip.figures.style import STYLE

sns.set_theme("paper", "ticks", "colorblind", font_scale=1.1, rc=STYLE)  # as roughslip.figures.style
mpl.rcParams["figure.constrained_layout.use"] = True
set_matplotlib_formats("svg", bbox_inches=None, metadata={"Date": None})


def panel(title: str = "", width: float = 3.6, height: float = 2.9, **labels: object) -> Axes:
    """A picture of one panel [inch]. labels : what Axes.set takes, such as xlabel and yscale"""
    axes = plt.subplots(figsize=(width, height))[1]
    axes.set_title(title, fontsize="medium", loc="left")
    axes.set(**labels)
    return axes
