"""Tables of a config that are values as they stand: numbers and names, checked once and frozen."""
