"""Builds FMUs (FMI 2.0 or 3.0, co-simulation and model exchange) from DH model files, simulates FMUs and plots the results.

From Python: `load` gives a `Model` with its equations (docs/python.md). `describe` reads a model file, `build` writes its FMU, `Session`
opens an FMU, `simulate` runs it with `Settings`.
"""

from importlib import import_module

__version__ = "0.1.0"  # read by CMakeLists.txt and pyproject.toml

# public names and their modules; a module is loaded when its name is first used
_PUBLIC = {
    "UserError": "errors",
    "Model": "library.model",
    "load": "library.model",
    "describe": "model.describe",
    "build": "fmu.build",
    "Session": "run.session",
    "Settings": "run.simulate",
    "simulate": "run.simulate",
}
__all__ = list(_PUBLIC)


def __getattr__(name: str) -> object:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'build_fmu' has no attribute '{name}'")
    return getattr(import_module(f"build_fmu.{_PUBLIC[name]}"), name)
