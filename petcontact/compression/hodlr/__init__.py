"""Compressed boundary operators and their direct solver. `compress` compresses an operator from its
entries, `factor` factorises the result."""

from .factor import factor
from .hodlr_matrix import HODLR, compress
from .translations import Stretch

__all__ = ["HODLR", "Stretch", "compress", "factor"]
