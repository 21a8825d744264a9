"""`python -m build_fmu` is the same as the command `build-fmu`."""

import sys

from build_fmu.cli import main

sys.exit(main())
