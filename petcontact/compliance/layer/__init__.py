"""The operator T of an elastic layer, spectrally near to S."""
