"""One contact scene in Drake, MuJoCo or Exudyn, for bench/contact.py (protocol in serve.hpp).

    python contact_peer.py {Drake|MuJoCo|Exudyn} SCENE.json

Rows: position of the body at the start and at the output times. A ball is a sphere, a block a rigid body on four small spheres; all
simulators use point contact. Drake and Exudyn combine the stiffnesses of both partners in series, so each has twice the value.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
from worker import serve


class Timer:
    """Sums the CPU time of its blocks."""

    def __init__(self):
        self.seconds = 0.0

    def __enter__(self):
        self.begin = time.process_time()

    def __exit__(self, *_):
        self.seconds += time.process_time() - self.begin


def spheres(data: dict) -> list[tuple[list[float], float]]:
    """Center and radius of each contact sphere."""
    lift = data["foot"]
    return [([x, y, z + lift], lift) for x, y, z in data["feet"]] or [([0.0, 0.0, 0.0], data["radius"])]


def start_position(data: dict, peer: str) -> list[float]:
    x, y, z = data["position"]
    return [x, y, z - data["depths"][peer]]


def drake(data: dict):
    """Methods: integration schemes; value: accuracy."""
    from pydrake.geometry import AddContactMaterial, HalfSpace, ProximityProperties, Sphere
    from pydrake.math import RigidTransform
    from pydrake.multibody.math import SpatialVelocity
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, ContactModel, CoulombFriction
    from pydrake.multibody.tree import RotationalInertia, SpatialInertia
    from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
    from pydrake.systems.framework import DiagramBuilder

    mu = data["friction"]

    def material():
        properties = ProximityProperties()
        AddContactMaterial(20.0 if data["damping"] else 0.0, 2 * data["stiffness"], CoulombFriction(mu, mu), properties)
        return properties

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    plant.set_contact_model(ContactModel.kPoint)
    plant.mutable_gravity_field().set_gravity_vector(data["gravity"])
    inertia = SpatialInertia.MakeFromCentralInertia(data["mass"], [0, 0, 0], RotationalInertia(*data["moment"]))
    body = plant.AddRigidBody("body", inertia)
    for k, (center, radius) in enumerate(spheres(data)):
        plant.RegisterCollisionGeometry(body, RigidTransform(center), Sphere(radius), f"s{k}", material())
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", material())
    plant.Finalize()
    diagram = builder.Build()

    def run(method: str, value: float):
        plant.set_stiction_tolerance(data["friction_velocity"]["CENIC" if method == "cenic" else "Drake"])
        simulator = Simulator(diagram)
        config = SimulatorConfig(integration_scheme=method, accuracy=value, max_step_size=0.1, use_error_control=True)
        ApplySimulatorConfig(config, simulator)
        context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        plant.SetFreeBodyPose(context, body, RigidTransform(start_position(data, "Drake")))
        plant.SetFreeBodySpatialVelocity(context, body, SpatialVelocity([0, 0, 0], data["velocity"]))
        simulator.Initialize()
        rows, timer = [plant.GetFreeBodyPose(context, body).translation()], Timer()
        for k in range(data["rows"]):
            with timer:
                simulator.AdvanceTo((k + 1) * data["end"] / data["rows"])
            rows.append(plant.GetFreeBodyPose(context, body).translation())
        return timer.seconds, np.array(rows)

    return run


MJCF = """<mujoco><option gravity="{gravity}" timestep="{step!r}" integrator="{method}" cone="elliptic"/>
<default><geom solref="-{stiffness} -{damping}" solimp="0.9999 0.9999 1e-4" friction="{friction} 0 0" condim="{condim}"/></default>
<worldbody><geom type="plane" size="100 100 1"/><body><freejoint/><inertial pos="0 0 0" mass="{mass}" diaginertia="{moment}"/>
{geoms}</body></worldbody></mujoco>"""


def mujoco(data: dict):
    """Methods: integrators; value: steps per output step. `solref` is a stiffness per mass, elastic for the bouncing ball."""
    import mujoco as mj

    def text(numbers) -> str:
        return " ".join(map(repr, numbers))

    geoms = "".join(f'<geom size="{radius}" pos="{text(center)}"/>' for center, radius in spheres(data))
    elastic = not data["friction"]
    per_mass = data["stiffness"] / data["mass"] if elastic else 1e5

    def run(method: str, value: float):
        model = mj.MjModel.from_xml_string(
            MJCF.format(
                gravity=text(data["gravity"]),
                step=data["end"] / data["rows"] / value,
                method=method,
                stiffness=per_mass,
                damping=0.0 if elastic else 2 * per_mass**0.5,
                friction=data["friction"],
                condim=1 if elastic else 3,
                mass=data["mass"],
                moment=text(data["moment"]),
                geoms=geoms,
            )
        )
        state = mj.MjData(model)
        state.qpos[:3], state.qvel[:3] = start_position(data, "MuJoCo"), data["velocity"]
        rows, timer = [state.qpos[:3].copy()], Timer()
        for _ in range(data["rows"]):
            with timer:
                mj.mj_step(model, state, nstep=int(value))
            rows.append(state.qpos[:3].copy())
        if any(state.warning[kind].number for kind in (mj.mjtWarning.mjWARN_BADQPOS, mj.mjtWarning.mjWARN_BADQACC)):
            raise RuntimeError("unstable")
        return timer.seconds, np.array(rows)

    return run


def exudyn(data: dict):
    """Methods: RK44, GeneralizedAlpha, value: steps per output step; DOPRI5, value: tolerance."""
    import exudyn as exu
    from exudyn.utilities import MarkerBodyRigid, ObjectGround, RigidBodyInertia, SensorBody

    exu.config.printToConsole = False
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    ground = mbs.AddMarker(MarkerBodyRigid(bodyNumber=mbs.AddObject(ObjectGround())))
    body = mbs.CreateRigidBody(
        inertia=RigidBodyInertia(mass=data["mass"], inertiaTensor=np.diag(data["moment"])),
        referencePosition=start_position(data, "Exudyn"),
        initialVelocity=data["velocity"],
        gravity=data["gravity"],
        nodeType=exu.NodeType.RotationRotationVector,
    )
    contact = mbs.AddGeneralContact()
    contact.SetFrictionPairings(np.array([[data["friction"]]]))
    contact.frictionProportionalZone = data["friction_velocity"]["Exudyn"]
    partner = {"contactStiffness": 2 * data["stiffness"], "contactDamping": 1000.0 if data["damping"] else 0.0, "frictionMaterialIndex": 0}
    for center, radius in spheres(data):
        contact.AddSphereWithMarker(mbs.AddMarker(MarkerBodyRigid(bodyNumber=body, localPosition=center)), radius=radius, **partner)
    size = 50.0
    corners = [[-size, -size, 0], [size, -size, 0], [size, size, 0], [-size, size, 0]]
    contact.AddTrianglesRigidBodyBased(rigidBodyMarkerIndex=ground, pointList=corners, triangleList=[[0, 1, 2], [0, 2, 3]], **partner)
    contact.SetSearchTreeCellSize([1, 1, 1])
    contact.SetSearchTreeBox([-size, -size, -1], [size, size, 5])
    contact.sphereSphereContact = False
    sensor = mbs.AddSensor(SensorBody(bodyNumber=body, outputVariableType=exu.OutputVariableType.Position, storeInternal=True))
    mbs.Assemble()

    def run(method: str, value: float):
        settings = exu.SimulationSettings()
        integration = settings.timeIntegration
        integration.endTime, integration.verboseMode = data["end"], 0
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = data["end"] / data["rows"]
        settings.solution.sensors.writeHeader = False
        settings.show.globalTimers = False
        integration.automaticStepSize = method == "DOPRI5"
        integration.explicit.computeEndOfStepAccelerations = False
        if method == "DOPRI5":
            integration.relativeTolerance, integration.absoluteTolerance = value, value / 100
            integration.initialStepSize, integration.minimumStepSize, integration.numberOfSteps = 1e-3, 1e-12, 20
        else:
            integration.numberOfSteps = data["rows"] * int(value)
        timer = Timer()
        with timer:
            good = mbs.SolveDynamic(settings, solverType=getattr(exu.DynamicSolverType, method), showHints=False)
        if not good:
            raise RuntimeError("the solver failed")
        stored = mbs.GetSensorStoredData(sensor)
        times = np.arange(data["rows"] + 1) * data["end"] / data["rows"]
        if abs(stored[-1, 0] - data["end"]) > 1e-9 or not np.isfinite(stored).all():
            raise RuntimeError("no finite result")
        # DOPRI5 stores its own steps: interpolated in uniform motion only
        return timer.seconds, np.stack([np.interp(times, stored[:, 0], stored[:, k]) for k in (1, 2, 3)], axis=1)

    return run


if __name__ == "__main__":
    serve({"Drake": drake, "MuJoCo": mujoco, "Exudyn": exudyn}[sys.argv[1]](json.loads(Path(sys.argv[2]).read_text())))
