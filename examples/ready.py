"""FMUs for the examples: builds out/NAME.fmu from models/NAME.toml if it does not exist."""

from pathlib import Path

from build_fmu.cli import main as build_fmu

MODELS, FOLDER = Path(__file__).parents[1] / "models", Path("out")


def ready(name: str, inverse: bool = False) -> str:
    """Returns the file of the FMU; if it cannot be built, exits with the message of build-fmu."""
    file = FOLDER / f"{name}{'_inverse' if inverse else ''}.fmu"
    if not file.exists():
        FOLDER.mkdir(exist_ok=True)
        if build_fmu(["build", "--no-show", *(["--inverse"] if inverse else []), str(MODELS / f"{name}.toml"), "-o", str(file)]) != 0:
            raise SystemExit(1)
    return str(file)
