"""Extreme cases derived from a model file, each run in a separate process, and pages with the results."""
