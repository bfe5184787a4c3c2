"""Shapes that a config may name: what `[geometry]` says, and the outline or the surface that
follows from it."""
