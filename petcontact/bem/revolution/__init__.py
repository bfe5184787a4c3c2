"""Kelvin's solution of rings: the kernels of bodies of revolution on their generating curves."""
