"""Fatigue of bodies under cycles of load, by multiaxial parameters of stress."""
