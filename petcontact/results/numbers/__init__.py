"""The numbers of a solution that are printed and written, with errors, and its largest stresses."""
