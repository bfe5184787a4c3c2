"""Displacement and stress inside a body."""
