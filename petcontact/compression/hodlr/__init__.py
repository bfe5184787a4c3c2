"""Compressed boundary operators and their direct solver: `compress` an operator from its entries, `factor` the result."""

from .factor import Factorisation, factor
from .matrix import HODLR, compress

__all__ = ["HODLR", "Factorisation", "compress", "factor"]
