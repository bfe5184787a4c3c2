"""Singular points, estimates, and the meshes they ask for."""
