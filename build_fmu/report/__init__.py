"""Work–precision reports: error against CPU time for methods, tolerances and communication step sizes, with recommendations."""
