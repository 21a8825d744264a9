"""A model as a Python object: its equations, linearisation and modes as NumPy arrays."""
