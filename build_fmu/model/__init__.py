"""Asks the compiled `describe` what a model file means, and handles the files beside it."""
