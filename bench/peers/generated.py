"""Writes and compiles straight-line C code of a tree's accelerations by CasADi, with the stages of DOP853 (dop853_runner.cpp).

    python generated.py SCENE.json FOLDER COMPILER

SciPy holds the coefficients. The program is FOLDER/dop853_SCENE.
"""

import subprocess
import sys
from pathlib import Path

import casadi
from scenes import Scene, read
from scipy.integrate import DOP853
from symbolic import Tree

OPTIONS = ("-std=c++17", "-O3", "-march=native")


def write_slope(scene: Scene, file: Path) -> None:
    """Writes `slope`: [q, qd] -> [qd, qdd]."""
    n = scene.joints
    y = casadi.SX.sym("y", 2 * n)
    states = casadi.vertsplit(y)
    qdd = Tree(scene, states[:n], states[n:], casadi.sin, casadi.cos).accelerations()
    slope = casadi.Function("slope", [y], [casadi.densify(casadi.vertcat(*states[n:], *qdd))], {"cse": True})
    generator = casadi.CodeGenerator(file.name, {"cpp": True})
    generator.add(slope)
    generator.generate(f"{file.parent}/")


def combination(weights, name: str = "k") -> str:
    return " + ".join(f"{weight!r} * {name}[{j}][i]" for j, weight in enumerate(map(float, weights)) if weight) or "0.0"


def write_stages(scene: Scene, file: Path) -> None:
    """Writes stages, error estimates and interpolant of DOP853 (Hairer, Norsett, Wanner 1993, II.5, II.6) without zero terms."""
    solver = DOP853(lambda t, y: y, 0.0, [0.0], 1.0)
    loop = "for (int i = 0; i < size; ++i)"
    text = [f"constexpr int size = {2 * scene.joints};", f"constexpr double start[] = {{{', '.join(map(repr, first_state(scene)))}}};"]
    text.append("inline void stages(const double* y, double h, double k[][size], double* z) {")
    for stage in range(1, 12):
        text += [f"  {loop} z[i] = y[i] + h * ({combination(solver.A[stage][:stage])});", f"  slope_of(z, k[{stage}]);"]
    text += [f"  {loop} z[i] = y[i] + h * ({combination(solver.B)});", "  slope_of(z, k[12]);", "}"]
    text.append("inline void errors(const double k[][size], double* fifth, double* third) {")
    text += [f"  {loop} fifth[i] = {combination(solver.E5)};", f"  {loop} third[i] = {combination(solver.E3)};", "}"]
    text.append("inline void interpolant(const double* y, const double* end, double h, double k[][size], double f[][size], double* z) {")
    for stage in range(13, 16):
        weights = solver.A_EXTRA[stage - 13][:stage]
        text += [f"  {loop} z[i] = y[i] + h * ({combination(weights)});", f"  slope_of(z, k[{stage}]);"]
    text += [f"  {loop} f[0][i] = end[i] - y[i];", f"  {loop} f[1][i] = h * k[0][i] - f[0][i];"]
    text.append(f"  {loop} f[2][i] = f[0][i] - h * k[12][i] - f[1][i];")
    text += [f"  {loop} f[{row + 3}][i] = h * ({combination(weights)});" for row, weights in enumerate(solver.D)]
    file.write_text("\n".join([*text, "}", ""]))


def first_state(scene: Scene) -> list[float]:
    return [*map(float, scene.data["initial"]["q"]), *map(float, scene.data["initial"]["qd"])]


def main():
    scene, folder = read(Path(sys.argv[1])), Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    write_slope(scene, folder / "slope.cpp")
    write_stages(scene, folder / "stages.hpp")
    here = Path(__file__).resolve().parent
    command = [sys.argv[3], *OPTIONS, f"-I{folder}", f"-I{here}", here / "dop853_runner.cpp", "-o", folder / f"dop853_{scene.name}"]
    subprocess.run(command, check=True)


if __name__ == "__main__":
    main()
