"""Model files: their description by the compiled program `describe`, and the files that they refer to."""
