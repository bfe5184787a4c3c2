"""The methods, one a module, chosen by name."""
