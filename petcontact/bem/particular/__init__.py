"""Volume loads without a volume mesh: solutions of Navier's equations for polynomial forces and
temperatures."""
