"""Curved panels, and the normals of the smooth surfaces that they stand for."""
