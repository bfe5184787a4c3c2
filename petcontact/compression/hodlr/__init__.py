"""Compressed boundary operators and their direct solver: `compress` an operator from its entries,
`factor` the result."""

from .factor import Factorisation, factor
from .matrix import HODLR, compress
from .translations import Stretch

__all__ = ["HODLR", "Factorisation", "Stretch", "compress", "factor"]
