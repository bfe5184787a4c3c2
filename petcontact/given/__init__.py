"""What is given, as functions of the place, made of numbers, expressions and functions."""
