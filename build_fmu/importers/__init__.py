"""Reads what users have – scenes, ReDySim files, URDF, DH tables – and writes model files. One format a file.

An importer fills a Draft; `toml_writer` writes it; `describe` (C++) alone judges the result.
"""
