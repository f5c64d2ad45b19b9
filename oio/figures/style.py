"""Figure style: a palette for colour-blind readers (Okabe and Ito 2008), one meaning per colour, and font sizes."""

from typing import Any

TRUTH, CALIBRATED, DEAD = "#A6A6A6", "#0072B2", "#D55E00"
BEACON, SOURCE, BELIEVED = "#009E73", "#F0E442", "#CC79A7"
ELEMENTS = ("#009E73", "#CC79A7", "#0072B2", "#D55E00")
COLD, COLD_OPEN = "#E69F00", "#56B4E9"
VARIANTS = {"cold": ("cold start", COLD), "cold_open": ("cold start, open", COLD_OPEN)}  # of the log: name and colour
SHADES = ("#FFFFFF", "#E9E9E9")  # background of alternate stages

RC: Any = {  # matplotlib types its keys one by one
    "font.size": 11,
    "axes.titlesize": 12.5,
    "axes.titleweight": "bold",
    "legend.fontsize": 10.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
}
