"""Identification of masses, inertias, friction and armatures from measured motion and torques (docs/identification.md)."""
