"""Converts scenes, ReDySim files, URDF files and DH tables to model files; one module per format.

An importer returns a Draft, `toml_writer` writes it, and `describe` (C++) checks the result.
"""
