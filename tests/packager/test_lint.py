"""The lint finds what it is for, and lets the rest pass."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def lint(tree, files):
    for name, text in files.items():
        path = tree / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    command = [sys.executable, str(ROOT / "scripts" / "lint.py"), str(tree)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout.splitlines()[:-1]


# put together here, so that this file itself has no machine path
HOME = "/" + "home/someone/project"


@pytest.mark.parametrize(
    ("name", "line", "sentence"),
    [
        ("fmu_src/math/a.hpp", '#include "model/model.hpp"', "math may not include model"),
        ("fmu_src/model/a.cpp", '#include "dynamics/aba.hpp"', "model may not include dynamics"),
        ("fmu_src/dynamics/deep/a.cpp", '  #  include "fmi/boundary/log.hpp"', "dynamics may not include fmi"),
        ("fmu_src/integrate/a.cpp", '#include "../fmi/boundary/log.hpp"', "integrate may not include fmi"),
        ("fmu_src/integrate/a.cpp", "#include <Eigen/Dense>", "may not include Eigen"),
        ("fmu_src/fmi/a.cpp", "#include <arkode/arkode_erkstep.h>", "may not include SUNDIALS"),
        ("fmu_src/dynamics/a.cpp", "#include <nvector/nvector_serial.h>", "may not include SUNDIALS"),
        ("fmu_src/fmi/a.cpp", "#include <toml++/toml.h>", "may not include toml++"),
        ("fmu_src/model/a.cpp", '#include "fmi2Functions.h"', "may not include the FMI headers"),
        ("fmu_src/model/a.cpp", '#include "model/read/names.hpp"', "in model the arrows go plain files → read"),
        (
            "fmu_src/dynamics/loops/a.hpp",
            '#include "dynamics/assembly/assembly.hpp"',
            "dynamics/loops/a.hpp may not include 'dynamics/assembly",
        ),
        ("fmu_src/integrate/system/a.cpp", '#include "integrate/methods/erk.hpp"', "the arrows go control → system, actuator → methods"),
        (
            "fmu_src/fmi/boundary/log.cpp",
            '#include "fmi/instance/life.hpp"',
            "fmi/boundary/log.cpp may not include 'fmi/instance/life.hpp'",
        ),
        ("fmu_src/fmi/new/a.cpp", '#include "fmi/instance/life.hpp"', "'fmi/new/a.cpp' has no level"),
        ("docs/a.md", f"see {HOME}/x", "is a path of one machine"),
        ("build_fmu/a.py", "x = (", "never closed"),
        ("tests/a.py", "\n" * 601, "more than 600 lines"),
        ("fmu_src/math/long.hpp", "int f() {\n" + "  g();\n" * 59 + "}", "function 'f' has 61 lines"),
        ("fmu_src/math/a.hpp", "int f(int x) { return " + "x && " * 15 + "x; }", "cyclomatic complexity 16"),
        ("tests/unit/nowhere/a_test.cpp", "", "has no folder 'nowhere'"),
        ("scripts/a.py", "def long():\n" + "    pass\n" * 60, "function 'long' has 61 lines"),
    ],
)
def test_breaches(tmp_path, name, line, sentence):
    code, lines = lint(tmp_path, {name: line + "\n"})
    assert code == 1 and len(lines) == 1
    assert lines[0].startswith(f"{name}:") and sentence in lines[0]


def test_what_is_allowed(tmp_path):
    allowed = {
        "fmu_src/math/a.hpp": "#include <Eigen/Core>\n#include <cmath>\n",
        "fmu_src/model/a.cpp": '#include "math/vec3.hpp"\n#include "model/model.hpp"\n#include <toml++/toml.h>\n',
        "fmu_src/dynamics/a.cpp": '#include "model/model.hpp"\n#include "dynamics/aba.hpp"\n#include <Eigen/Dense>\n',
        "fmu_src/integrate/a.cpp": '#include "dynamics/aba.hpp"\n#include <cvode/cvode.h>\n// #include "fmi/boundary/log.hpp"\n',
        "fmu_src/fmi/a.cpp": '#include "fmi2Functions.h"\n#include "integrate/methods/integrator.hpp"\n#include "math/vec3.hpp"\n',
        "fmu_src/fmi/boundary/fmi2.cpp": '#include "fmi/instance/life.hpp"\n#include "fmi/boundary/log.hpp"\n',
        "fmu_src/dynamics/plan.cpp": '#include "dynamics/loops/cluster_builder.hpp"\n#include "dynamics/plan.hpp"\n',
        "fmu_src/dynamics/loops/a.hpp": '#include "dynamics/plan.hpp"\n',
        "tests/unit/a.cpp": '#include "fmi/boundary/log.hpp"\n#include <Eigen/Dense>\n',
        "build/x/a.py": "x = (\n",
        "docs/a.md": "use $HOME/work/x, ~/tmp/y, https://example.org/home/page and docs/tmp/z\n",
    }
    assert lint(tmp_path, allowed) == (0, [])


@pytest.mark.parametrize(
    ("files", "start", "sentence"),
    [
        ({"model/a.py": "from build_fmu.fmu.b import x", "fmu/b.py": ""}, "build_fmu/model/a.py:1:", "build_fmu.model.a may not import build_fmu.fmu.b"),
        ({"run/a.py": "def f():\n    from build_fmu.show import b", "show/b.py": ""}, "build_fmu/run/a.py:2:", "may not import build_fmu.show.b"),
        ({"errors.py": "import build_fmu.model.a", "model/a.py": ""}, "build_fmu/errors.py:1:", "may not import build_fmu.model.a"),
        ({"run/a.py": "from build_fmu.run.b import x", "run/b.py": "from build_fmu.run import a"}, "build_fmu/run/a.py:1:",
         "cyclic import: build_fmu.run.a → build_fmu.run.b → build_fmu.run.a"),
    ],
)  # fmt: skip
def test_imports_of_the_packager_go_one_way(tmp_path, files, start, sentence):
    code, lines = lint(tmp_path, {f"build_fmu/{name}": text + "\n" for name, text in files.items()})
    assert code == 1 and len(lines) == 1
    assert lines[0].startswith(start) and sentence in lines[0]


def test_imports_that_are_allowed(tmp_path):
    files = {"__init__.py": "", "errors.py": "", "model/__init__.py": "", "model/a.py": "from build_fmu import errors", "run/__init__.py": "",
             "run/a.py": "from build_fmu.model.a import x\nfrom build_fmu.run import b", "run/b.py": "import os", "cli/__init__.py": "from build_fmu.cli import c",
             "cli/c.py": "from build_fmu.cli.d import x", "cli/d.py": "from build_fmu import __version__", "__main__.py": "from build_fmu.cli import main"}  # fmt: skip
    assert lint(tmp_path, {f"build_fmu/{name}": text + "\n" for name, text in files.items()}) == (0, [])


def test_lines_are_numbered(tmp_path):
    _, lines = lint(tmp_path, {"fmu_src/math/a.hpp": '\n\n#include "fmi/boundary/log.hpp"\n'})
    assert lines[0].startswith("fmu_src/math/a.hpp:3: ")
