"""From a case to its solution."""
