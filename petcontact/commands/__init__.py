"""The commands of `petcontact`: one module each, with `add_arguments(parser)` and `run(arguments,
petsc_words)`."""
