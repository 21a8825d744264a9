"""Runs FMUs in FMPy (`simulate`) or in the compiled driver (`driver`), with inputs as functions of time."""
