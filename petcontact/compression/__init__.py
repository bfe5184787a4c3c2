"""Hierarchical matrices; they know entries and points, nothing of elasticity."""
