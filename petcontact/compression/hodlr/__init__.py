"""Compressed boundary operators and their direct solver: `compress` an operator from its entries, `factor` the result."""

from .factor import Factorisation, factor
from .matrix import HODLR, ErrorEstimate, LevelRanks, compress

__all__ = ["HODLR", "ErrorEstimate", "Factorisation", "LevelRanks", "compress", "factor"]
