"""Kelvin's solution in the plane, integrated over elements in closed form."""
