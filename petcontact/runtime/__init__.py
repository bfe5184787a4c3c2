"""How a process behaves: PETSc, threads, signals, MPI, files written whole."""
