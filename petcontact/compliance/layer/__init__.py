"""The surrogate T of an elastic layer, which is spectrally close to S."""
