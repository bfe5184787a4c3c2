"""Boundary meshes: elements, bases, grading."""
