"""A self-contained HTML page that plays a simulation in 3D with plots, and films."""
