"""Extreme cases made from a model file, each run in a process of its own, and a page that says how they went."""
