"""Unilateral contact with Coulomb or Tresca friction between bodies that may be held by contact only."""
