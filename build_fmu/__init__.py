"""Packs a DH model file into an FMI 2.0 co-simulation FMU, simulates FMUs and draws what they did."""

__version__ = "0.1.0"
