"""Contact by its active set: the exchanges, who solves their linear equations, and rigid motions
beside them."""
