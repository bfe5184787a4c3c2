"""Meshes that follow the solution, and what is known of the error."""
