"""Sweep files: crossed, zipped and sampled lists of values, to cases with readable ids."""
