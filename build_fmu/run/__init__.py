"""Runs FMUs: through FMPy (`simulate`) or the compiled driver (`driver`), with inputs as functions of time."""
