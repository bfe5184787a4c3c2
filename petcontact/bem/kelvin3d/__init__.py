"""Kelvin's solution in space, integrated over flat panels."""
