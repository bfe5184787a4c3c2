"""Boundary data and boundary integral operators."""
