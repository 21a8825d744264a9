"""A PD controller as an FMU, by PythonFMU: it swings the crank of the four-bar to 0.5 rad."""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class CrankController(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.q = self.qd = self.tau = 0.0
        for name, causality in (("q", Fmi2Causality.input), ("qd", Fmi2Causality.input), ("tau", Fmi2Causality.output)):
            self.register_variable(Real(name, causality=causality, variability=Fmi2Variability.continuous))

    def do_step(self, current_time, step_size):
        self.tau = 4.0 * (0.5 - self.q) - 0.2 * self.qd
        return True
