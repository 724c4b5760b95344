"""Matplotlib without a display, or the message that says how to install it."""

from ..errors import InputError

try:
    import matplotlib
except ImportError as error:
    raise InputError(f'figures need Matplotlib ({error}): pip install "amontons[cli]"') from None

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter

__all__ = ["Axes", "NullFormatter", "plt"]
