"""Active-set solution of contact: exchanges, linear solvers, and rigid motions."""
