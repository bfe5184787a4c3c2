"""Figures of a solution: by dimension, whatever the problem."""
