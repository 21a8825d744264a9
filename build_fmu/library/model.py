"""The class `Model`: the equations of a model file for controllers, observers and identification, as NumPy arrays.

All values are in SI units and rad. `n` states, `k` inputs; `docs/python.md` describes the methods.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from build_fmu.arguments import by_rows, finite, mapping, measured, names_of, number, numbers, path_of, positive, vector, whole
from build_fmu.errors import UserError, unknown
from build_fmu.fmu import build as packager
from build_fmu.identify.design import Trajectory, design, limits_of
from build_fmu.identify.parameters import Plant
from build_fmu.identify.run import Identification, Run, identify
from build_fmu.library.batch import Runs, parted, simulate_batch, simulate_on_cluster
from build_fmu.library.evaluation import INDEPENDENT, Evaluation
from build_fmu.library.flow import step_derivative
from build_fmu.library.holding import holding_inputs
from build_fmu.library.modes import Modes, modes_at, rates_of
from build_fmu.library.regression import plant_of, torques_on
from build_fmu.library.staging import Variant, sample_time_of, source_of, stage
from build_fmu.model.describe import describe
from build_fmu.run.driver import Task, staged
from build_fmu.run.prescribed import MOTION
from build_fmu.run.session import Session
from build_fmu.run.signals import number_of
from build_fmu.run.simulate import Result, Settings, simulate

POSITION, VELOCITY = re.compile(r".*\.(q|quaternion\[\d\])"), re.compile(r".*\.(qd|omega\[\d\])")
START = re.compile(r"(.*\.)(q|qd|quaternion|omega)(\[\d\])?$")
START_OF_VELOCITY = re.compile(r"\.(qd|omega)0(\[\d\])?$")
MATRIX, BIAS = re.compile(r"mass_matrix\[\d+,\d+\]"), re.compile(r"bias\[\d+\]")
TERMS = ("acceleration", "mass_matrix", "bias")
DEGREES = {"fixed": 0, "spherical": 3}  # of freedom; other links of the tree have one
WHOLE = 1e-9  # of the stop time: rounding of a number of steps
SAME_POSE = 1e-6  # rad or m


def load(file: str | Path, tunable: Sequence[str] = ()) -> Model:
    """Returns the model of a model file; raises UserError for a wrong file. `tunable` are further tunable parameters."""
    return Model(path_of("the model file", file), tunable)


class Model:
    """A model file whose equations can be evaluated; every method uses `parameters`, start values by name."""

    def __init__(self, file: Path, tunable: Sequence[str] = ()) -> None:
        """Reads the file."""
        description = describe(file)
        self._source = source_of(file, description)
        self.file = self._source.path
        self.description = replace(description, folder=self.file.parent)
        self.sample_time = sample_time_of(self._source)
        self._parameters: dict[str, float | str] = {}
        self._tunable = names_of("tunable", tunable)
        self._folder = tempfile.TemporaryDirectory()
        self._fmus: dict[Variant, Path] = {}
        self._opened: dict[str, tuple[Session, dict[str, float] | None]] = {}
        if self._tunable:
            self._check_tunable()

    def _check_tunable(self) -> None:
        try:
            self._fmu(Variant(tunable=self._tunable))
        except UserError as error:
            # the file of the user has other positions
            first = str(error).partition("\n")[0]
            raise UserError(re.sub(rf"^{re.escape(str(self.file))}:\d+:\d+: fmu: ", "", first)) from None

    @property
    def parameters(self) -> dict[str, float | str]:
        """Start values by name."""
        return self._parameters

    @parameters.setter
    def parameters(self, values: Mapping[str, float | str]) -> None:
        values = mapping("parameters", values)
        known = [*(v.name for v in self.description.select("parameter")), *self._tunable]
        for name in values:
            # variants of the file may have more start values than the file
            if name not in known and name not in self._names_of_equations():
                raise unknown("parameter", name, known)
        self._parameters = {name: self._value_of(name, value) for name, value in values.items()}

    def _value_of(self, name: str, value: float | str) -> float | str:
        """Returns a value, of a number also by an expression such as `pi/2`."""
        texts = [v.name for v in self.description.variables if v.type == "String"]
        if isinstance(value, str):
            return value if name in texts else number_of(value, f"parameter '{name}'")
        return finite("parameter", name, value)

    def _names_of_equations(self) -> list[str]:
        try:
            return self._equations().names("parameter")
        except UserError:
            return []  # of a model without equations in continuous time

    # files and runs

    def build(self, target: str | Path | None = None, **options) -> Path:
        """Writes the FMU, by default beside the current folder's other files, and returns its path; options of `build_fmu.build`."""
        path = path_of("the target", target) if target else Path(f"{self.file.stem}.fmu")
        with tempfile.TemporaryDirectory() as folder:
            copy = self._source.write(Path(folder))
            try:
                packager.build(self.description, copy, path, **options)
            except UserError as error:
                raise UserError(str(error).replace(str(copy), str(self.file))) from None
        return path

    def simulate(
        self,
        stop: float | None = None,
        step: float | None = None,
        inputs: Mapping[str, str | float | tuple[ArrayLike, ArrayLike]] | None = None,
        outputs: Sequence[str] = (),
        start: Mapping[str, float | str] | None = None,
    ) -> Result:
        """Simulates; an input is a number, an expression of t, or times (s) and values that are interpolated linearly."""
        inputs, starts, chosen = mapping("inputs", inputs), self.parameters | mapping("start", start), names_of("outputs", outputs)
        stop, step = (None if t is None else positive(what, t) for what, t in (("the stop time", stop), ("the step size", step)))
        with tempfile.TemporaryDirectory() as folder, Session(self._fmu(Variant(tunable=self._tunable))) as session:
            given = [_input(name, value, Path(folder) / f"{i}.csv") for i, (name, value) in enumerate(inputs.items())]
            values = [_argument("parameter", name, value) for name, value in starts.items()]
            return simulate(session, Settings(stop, step, None, values, given, chosen, "all"))

    def simulate_many(
        self,
        inputs: ArrayLike | None = None,
        parameters: Mapping[str, ArrayLike | str] | None = None,
        workers: int = 1,
        stop: float | None = None,
        step: float | None = None,
        outputs: Sequence[str] = (),
        every: int = 0,
        client=None,
    ) -> Runs:
        """Simulates a batch in compiled code: inputs (runs x steps x k), held during each step; parameters (runs) by name.

        Rows of outputs are recorded at the start, after each `every` steps (0: none) and at the end. `client` is a Dask client, whose
        workers run the batch in place of local `workers`.
        """
        archive = self._fmu(Variant(tunable=self._tunable))
        with staged(archive) as fmu:
            size = fmu.step if step is None else positive("the step size", step)
            end = fmu.stop if stop is None else positive("the stop time", stop)
            steps = max(1, round(end / size))
            if abs(steps * size - end) > WHOLE * end:
                raise UserError(f"the stop time {end:g} s is not a multiple of the step size {size:g} s")
            whole("workers", workers, 1), whole("every", every, 0)
            chosen = list(names_of("outputs", outputs)) or fmu.reals()
            for name in chosen:
                if name not in fmu.reals():
                    raise unknown("output", name, fmu.reals())
            given = None if inputs is None else numbers(inputs, "'inputs'")
            if given is not None and (given.ndim != 3 or given.shape[1:] != (steps, len(fmu.names("input")))):
                raise UserError(f"'inputs' must have the shape (runs, {steps}, {len(fmu.names('input'))}), got {given.shape}")
            texts, values = parted(fmu, self.parameters | mapping("parameters", parameters))
            task = Task(size, steps, every or steps, texts, chosen)
            if client is not None:
                return simulate_on_cluster(client, archive, fmu, task, given, values)
            return simulate_batch(fmu, task, given, values, workers)

    # equations of motion

    @property
    def states(self) -> list[str]:
        """Names of the entries of x."""
        return self._equations().names_of_states

    @property
    def inputs(self) -> list[str]:
        """Names of the entries of u."""
        return self._equations().inputs

    @property
    def positions(self) -> list[str]:
        """Names of the entries of q: a part of the states."""
        return [n for n in self.states if POSITION.fullmatch(n)]

    @property
    def velocities(self) -> list[str]:
        """Names of the entries of qd and qdd."""
        return [n for n in self.states if VELOCITY.fullmatch(n)]

    def start(self) -> np.ndarray:
        """Returns the start state x (n)."""
        return self._equations().start.copy()

    def start_inputs(self) -> np.ndarray:
        """Returns the start values of the inputs u (k): zero, for prescribed joints their start position and velocity."""
        equations = self._equations()
        return np.array([float(equations.variables[n].start or 0) for n in equations.inputs])

    def state(self, q: ArrayLike | None = None, qd: ArrayLike | None = None) -> np.ndarray:
        """Returns the start state with these positions and velocities."""
        x = self.start()
        for values, names, letter in ((q, self.positions, "q"), (qd, self.velocities, "qd")):
            if values is not None:
                x[self._rows_of(names)] = vector(values, names, letter)
        return x

    def start_values(self, x: ArrayLike | None = None, u: ArrayLike | None = None) -> dict[str, float]:
        """Returns the start values of all joints, also of those in loops, at state x and inputs u: for `start` of `simulate`."""
        equations = self._equations()
        equations.place(*self._point(x, u))
        return _joints(equations)

    def slope(self, x: ArrayLike | None = None, u: ArrayLike | None = None) -> np.ndarray:
        """Returns x' (n) of the state x and the inputs u (k); by default those at the start."""
        return self._continuous().slope(*self._point(x, u))

    def forward(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike | None = None) -> np.ndarray:
        """Returns the accelerations; one row of each argument, or as many rows as q has. `tau` are all inputs, by default the start."""
        return by_rows(self._forward, q, qd, self.start_inputs() if tau is None else tau)

    def inverse(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> np.ndarray:
        """Returns the torques (N m, N) of the driven joints for their motion; one row of each argument, or as many rows as q has."""
        session = self._open("inverse", Variant((), self._tunable, "given", True))
        return by_rows(lambda *row: self._inverse(session, *row), q, qd, qdd)

    def plant(self) -> Plant:
        """Returns the driven joints and their parameters, with torques and regressor for any motion: the model of `identify`."""

        def inverse(tunable: tuple[str, ...]) -> Session:
            variant = Variant(("regressor",), tunable, "given", True, ("trajectory", "controller"))
            return self._open(f"regressor with {' '.join(tunable)}", variant)

        tunable = [*self._tunable, *(v.name for v in self.description.variables if v.variability == "tunable")]
        return plant_of(self._source.document, inverse, self.parameters, tunable)

    def mass_matrix(self, q: ArrayLike | None = None) -> np.ndarray:
        """Returns M (t x t) of the tree, in the order of `velocities`."""
        equations = self._equations()
        equations.place(*self._point(self.state(q), None))
        # not of a joint with this name
        names = [n for n in equations.variables if MATRIX.fullmatch(n)]
        order = self._tree_order()
        return np.array(equations.read(names)).reshape(len(order), -1)[np.ix_(order, order)]

    def bias(self, q: ArrayLike | None = None, qd: ArrayLike | None = None) -> np.ndarray:
        """Returns Coriolis, centrifugal, gyroscopic and gravity forces (t) of the tree, in the order of `velocities`."""
        equations = self._equations()
        equations.place(*self._point(self.state(q, qd), None))
        return np.array(equations.read([n for n in equations.variables if BIAS.fullmatch(n)]))[self._tree_order()]

    # identification

    def identify(
        self,
        time: ArrayLike,
        q: ArrayLike,
        tau: ArrayLike,
        qd: ArrayLike | None = None,
        qdd: ArrayLike | None = None,
        parameters: Sequence[str] = (),
        cutoff: float | None = None,
    ) -> Identification:
        """Identifies links and `<joint>.damping`, `.friction`, `.armature` (with * as wildcard, default: all) from measured rows.

        Missing velocities and accelerations follow from the positions, by a zero-phase filter of `cutoff` (Hz).
        """
        plant = self.plant()
        rows = [
            None if a is None and letter in ("qd", "qdd") else measured(a, plant.joints, letter)
            for a, letter in ((q, "q"), (tau, "tau"), (qd, "qd"), (qdd, "qdd"))
        ]
        run = Run(measured(np.reshape(numbers(time, "'time'"), (-1, 1)), ["time"], "time")[:, 0], *rows)
        if any(part is not None and len(part) != len(run.time) for part in rows):
            raise UserError(f"the rows of the run must be as many as its times, {len(run.time)}")
        cutoff = None if cutoff is None else positive("the cutoff", cutoff, "frequency in Hz")
        return identify(plant, run, names_of("parameters", parameters), cutoff)

    def design(
        self,
        low: ArrayLike,
        high: ArrayLike,
        speed: ArrayLike,
        duration: float = 10,
        step: float = 0.01,
        parameters: Sequence[str] = (),
    ) -> Trajectory:
        """Proposes a motion of the driven joints for `identify`, within positions (rad, m) and speeds."""
        plant, times = self.plant(), (number("the duration", duration), number("the step", step))
        return design(plant, limits_of(plant, low, high, speed), *times, names_of("parameters", parameters))

    # linearisation

    def linearise(self, x: ArrayLike | None = None, u: ArrayLike | None = None, h: float | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Returns A (n x n) and B (n x k): derivatives of x' by x and u, or with h (s) those of the state after h, with u held."""
        equations = self._continuous()
        x, u = self._point(x, u)
        if h is not None:
            return step_derivative(equations, x, u, positive("the step size h", h))
        equations.place(x, u)
        both = equations.jacobian(equations.slopes, [*equations.states, *equations.inputs])
        return both[:, : len(x)], both[:, len(x) :]

    def step(self, x: ArrayLike | None = None, u: ArrayLike | None = None, h: float | None = None) -> np.ndarray:
        """Returns the state after h (s) with u held, by the solver of the model file."""
        x, u, h = *self._point(x, u), positive("the step size h", h)
        session = self._open("step", Variant(TERMS, self._tunable, "given"))
        starts = self.start_values(x, u)
        without = [n for n in self.states if _start_of(n) not in starts]
        if without:
            raise UserError(f"step: state '{without[0]}' has no start parameter")
        session.restart({**self.parameters, **starts, **dict(zip(self.inputs, u, strict=True))})
        session.step(0.0, h)
        return np.array(session.read(self.states))

    def equilibrium(self, u: ArrayLike | None = None, q: ArrayLike | None = None) -> np.ndarray:
        """Returns the state at rest nearest to q (default: the start) under held inputs u; raises UserError if none is found.

        Also if its coordinates in loops, which belong to the start pose, are others there: use `start_at_rest` then.
        """
        starts, x = self._at_rest(u, q)
        if not self._is_pose(x, starts):
            raise UserError("the independent coordinates of the loops at rest are not those at the start: use `start_at_rest`")
        return x

    def start_at_rest(self, u: ArrayLike | None = None) -> np.ndarray:
        """Makes this equilibrium the start of a model with loops, whose coordinates are chosen there; returns the state at rest."""
        starts, x = self._at_rest(u, None)
        if not self._has_loops():
            return x
        found = dict(zip(self.states, x, strict=True))
        self._parameters = self.parameters | starts
        start = dict(zip(self.states, self.start(), strict=True))
        of_loops = starts.keys() | {_start_of(n) for n in self._unnamed_states()}
        return np.array([found.get(n, value) if _start_of(n) not in of_loops else value for n, value in start.items()])

    def _is_pose(self, x: np.ndarray, starts: dict[str, float]) -> bool:
        """Returns whether x, read by its names from another instance, is the pose with these start values of all joints."""
        if not self._has_loops():
            return True
        # a quaternion and its negative are the same orientation
        return all(abs(abs(value) - abs(starts[n])) < SAME_POSE * max(1, abs(value)) for n, value in self.start_values(x).items())

    def _has_loops(self) -> bool:
        return any(INDEPENDENT.fullmatch(n) for n in self._equations().states)

    def _unnamed_states(self) -> list[str]:
        """Returns the independent coordinates that are no joint's position: their meaning belongs to the start pose."""
        return [n for n in self.states if INDEPENDENT.fullmatch(n)]

    def _at_rest(self, u: ArrayLike | None, q: ArrayLike | None) -> tuple[dict[str, float], np.ndarray]:
        x, u = self._point(None if q is None else self.state(q), u)
        x = self.without_velocity(x)
        # velocities that follow from loops are rounding, not 0
        starts = {n: 0.0 if START_OF_VELOCITY.search(n) else value for n, value in self.start_values(x).items()}
        variant = replace(Variant(TERMS, self._tunable), start="equilibrium")
        with Evaluation(self._fmu(variant)) as session:
            session.begin({**self.parameters, **starts, **dict(zip(self.inputs, u, strict=True))})
            return _joints(session), np.array(session.read(self.states))

    def without_velocity(self, x: ArrayLike | None = None) -> np.ndarray:
        """Returns the state with the positions of x and all velocities zero."""
        x = self._point(x, None)[0]
        equations = self._equations()
        x[[equations.states.index(n) for n in rates_of(equations)]] = 0
        return x

    def hold(self, x: ArrayLike | None = None) -> np.ndarray:
        """Returns the inputs u (k) of least norm that hold the pose of x at rest; raises UserError if none do.

        Prescribed joints rest at their start positions.
        """
        x, u = self._point(self.without_velocity(x), None)
        equations = self._continuous()
        prescribed = np.array([name.endswith(MOTION) for name in self.inputs], dtype=bool)
        u[[name.endswith(MOTION[1:]) for name in self.inputs]] = 0
        u, left, at_rest = holding_inputs(equations, self._energy(), x, u, prescribed)
        if not at_rest.all():
            worst = int(np.where(at_rest, 0, abs(left)).argmax())
            name = equations.name_of(equations.slopes[worst])
            others = len(x) - len(self.positions) - len(self.velocities)
            hint = "; the actuators keep their states in x, which `equilibrium` returns for given inputs" if others else ""
            raise UserError(f"no inputs hold the model at rest: '{name}' is {left[worst]:.3g} with the best ones{hint}")
        return u

    def modes(self, x: ArrayLike | None = None, u: ArrayLike | None = None) -> Modes:
        """Returns the undamped modes of small motions about a state at rest."""
        x, u = self._point(x, u)
        return modes_at(self._continuous(), self._energy(), x, u)

    # instances

    def close(self) -> None:
        """Frees the instances and removes temporary files; the next method makes them again."""
        for session, _ in self._opened.values():
            session.close()
        self._opened, self._fmus = {}, {}
        self._folder.cleanup()
        self._folder = tempfile.TemporaryDirectory()

    def __getstate__(self) -> dict[str, object]:
        """Returns what a copy needs: it makes its own instances and temporary files."""
        return {name: value for name, value in self.__dict__.items() if name not in ("_opened", "_fmus", "_folder")}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state, _opened={}, _fmus={}, _folder=tempfile.TemporaryDirectory())

    def __enter__(self) -> Model:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _fmu(self, variant: Variant) -> Path:
        if variant not in self._fmus:
            folder = Path(tempfile.mkdtemp(dir=self._folder.name))
            self._fmus[variant] = stage(self._source, self.description.resources, variant, folder)
        return self._fmus[variant]

    def _equations(self) -> Evaluation:
        """Returns the instance that evaluates the equations, with the current parameters."""
        return self._evaluation("equations", TERMS)

    def _energy(self) -> Evaluation:
        """Returns an instance that evaluates the kinetic energy."""
        return self._evaluation("energy", ("energy",))

    def _evaluation(self, name: str, outputs: tuple[str, ...]) -> Evaluation:
        """Returns an instance with these outputs and the current parameters."""
        session, used = self._opened.get(name, (None, None))
        if session is None:
            session = Evaluation(self._fmu(Variant(outputs, self._tunable, "given"))).__enter__()
        if used != self.parameters:
            self._opened[name] = (session, None)  # refused parameters leave it without a state
            for parameter in self.parameters:
                session.find(parameter, "parameter", session.names("parameter"))
            session.begin(self.parameters)
            self._opened[name] = (session, dict(self.parameters))
        return session

    def _continuous(self) -> Evaluation:
        """Returns the same; raises UserError if a sampled controller holds torques, which do not follow from the present state."""
        if self.sample_time:
            raise UserError(
                f"the controller is sampled every {self.sample_time:g} s, so x' does not follow from x and u alone: "
                "remove sample_time, or use the method step of the Python library"
            )
        return self._equations()

    def _open(self, name: str, variant: Variant) -> Session:
        """Returns a co-simulation instance, in initialization mode or later."""
        if name not in self._opened:
            self._opened[name] = (Session(self._fmu(variant)).__enter__(), {})
        return self._opened[name][0]

    def _tree_order(self) -> np.ndarray:
        """Places of the velocities of the tree in docs/equations.md: the angular velocities of spherical and free joints come last."""
        kinds = [link["type"] for link in self.description.drawing["links"]]
        return np.argsort([kind == "spherical" for kind in kinds for _ in range(DEGREES.get(kind, 1))], kind="stable")

    def _rows_of(self, names: Sequence[str]) -> list[int]:
        """Places of these states in x."""
        places = {name: k for k, name in enumerate(self.states)}
        return [places[name] for name in names]

    def _point(self, x: ArrayLike | None, u: ArrayLike | None) -> tuple[np.ndarray, np.ndarray]:
        equations = self._equations()
        x = self.start() if x is None else vector(x, self.states, "x")
        return x, self.start_inputs() if u is None else vector(u, equations.inputs, "u")

    def _forward(self, q: np.ndarray, qd: np.ndarray, tau: np.ndarray) -> np.ndarray:
        return self.slope(self.state(q, qd), tau)[self._rows_of(self.velocities)]

    def _inverse(self, session: Session, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
        joints = [n.removesuffix(".q") for n in session.names("input") if n.endswith(".q")]
        given = {}
        for letter, values in (("q", q), ("qd", qd), ("qdd", qdd)):
            names = [f"{joint}.{letter}" for joint in joints]
            given |= dict(zip(names, vector(values, names, letter), strict=True))
        # the inverse has no start values, because its motion is given
        names = [*session.names("parameter"), *(v.name for v in self.description.select("parameter"))]
        for name in self.parameters:
            if name not in names:
                raise unknown("parameter", name, names)
        parameters = {name: value for name, value in self.parameters.items() if name in session.variables}
        session.restart({**parameters, **given})
        return np.array(session.read(torques_on(session, joints)))


def _start_of(state: str) -> str:
    """Returns the name of the start parameter of a state."""
    return START.sub(r"\g<1>\g<2>0\g<3>", state)


def _joints(session: Evaluation) -> dict[str, float]:
    """Returns the start parameters of positions and velocities, with the values of the current state."""
    starts = {n: _start_of(n) for n in session.names("output") if START.fullmatch(n)}
    starts = {n: start for n, start in starts.items() if start in session.names("parameter")}
    return dict(zip(starts.values(), session.read(list(starts)), strict=True))


def _argument(kind: str, name: str, value: str | float) -> str:
    """Returns the argument of `Settings` for a number or a text."""
    return f"{name}={value if isinstance(value, str) else repr(float(finite(kind, name, value)))}"


def _input(name: str, value: str | float | tuple[ArrayLike, ArrayLike], table: Path) -> str:
    """Returns the argument of `Settings`, with a table for times and values."""
    if not isinstance(value, tuple):
        return _argument("input", name, value)
    if len(value) != 2:
        raise UserError(f"input '{name}' must be times and values, got {len(value)} entries")
    times, values = (numbers(part, f"times and values of input '{name}'") for part in value)
    if times.ndim != 1 or times.shape != values.shape:
        raise UserError(f"input '{name}' must be two vectors of one length, got shapes {times.shape} and {values.shape}")
    if not len(times):
        raise UserError(f"input '{name}' has no values")
    if (np.diff(times) < 0).any():
        raise UserError(f"input '{name}': times must not decrease")
    rows = "\n".join(f"{t!r},{v!r}" for t, v in zip(times.tolist(), values.tolist(), strict=True))
    table.write_text(f"time,{name}\n{rows}\n", encoding="utf-8")
    return f"{name}={table}"
