"""The options of `build-fmu import` with their defaults, for tests that call an importer."""

import argparse

from build_fmu.cli import parser_of_commands


def import_options(**changes) -> argparse.Namespace:
    options = parser_of_commands().parse_args(["import", "robot"])
    assert set(changes) <= set(vars(options))
    vars(options).update(changes)
    return options
