"""What accuracy costs: error against run time over methods, tolerances and communication steps, as tables, picture and advice."""
