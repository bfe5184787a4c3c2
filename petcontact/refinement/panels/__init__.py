"""Surfaces: the error on each panel, which panels to cut, and their quarters."""
