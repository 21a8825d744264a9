"""One HTML page that plays a run: the mechanism in 3D beside linked plots. Needs no network and no other file."""
