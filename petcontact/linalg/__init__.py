"""PETSc solvers and how rows lie over ranks."""
