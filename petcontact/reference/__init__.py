"""Closed forms of elasticity and contact, for tests, examples and users; numpy and scipy only."""
