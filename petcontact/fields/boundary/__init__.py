"""Stress on the boundary of a body."""
