"""Increment after increment of the load steps: where they start, what they leave, why they fail."""
