"""Drake's continuous multibody plant with its error-controlled integrators, for work_precision.py (see serve.hpp).

    python drake_peer.py SCENE.json

Methods: names of Drake's integration schemes, `SCHEME:SECONDS` with a maximum step size; value: accuracy. `sap`: the discrete plant with
the SAP solver, the only one with loop constraints; value: number of steps per output step. A C++ logger records the rows, so Python runs
once per simulation.
"""

import sys
import time
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import DiscreteContactApproximation, MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    LinearSpringDamper,
    PrismaticJoint,
    RevoluteJoint,
    RevoluteSpring,
    RotationalInertia,
    SpatialInertia,
    UnitInertia,
)
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial
from scenes import Scene, read
from worker import serve


def spatial_inertia(body: dict) -> SpatialInertia:
    mass, com = body["mass"], np.array(body["com"])
    xx, yy, zz, xy, xz, yz = body["inertia"]
    central = RotationalInertia(xx, yy, zz, xy, xz, yz)
    moments = central.ShiftFromCenterOfMass(mass, -com).CopyToFullMatrix3() / mass
    unit = UnitInertia(moments[0, 0], moments[1, 1], moments[2, 2], moments[0, 1], moments[0, 2], moments[1, 2])
    return SpatialInertia(mass, com, unit, skip_validity_check=True)


def build(scene: Scene, plant_step: float):
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(plant_step))
    if plant_step > 0:
        plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
    bodies = {-1: plant.world_body()}
    joints = []
    for k, body in enumerate(scene.data["bodies"]):
        bodies[k] = plant.AddRigidBody(f"b{k}", spatial_inertia(body))
        joint = body["joint"]
        placement = joint["placement"]
        pose = RigidTransform(RotationMatrix(np.array(placement["R"])), placement["p"])
        kind = RevoluteJoint if joint["type"] == "revolute" else PrismaticJoint
        joints.append(
            plant.AddJoint(
                kind(
                    f"j{k}",
                    plant.AddFrame(FixedOffsetFrame(f"f{k}", bodies[body["parent"]], pose)),
                    bodies[k].body_frame(),
                    [0, 0, 1],
                    joint.get("damping", 0.0),
                )
            )
        )
        if joint.get("stiffness"):
            plant.AddForceElement(RevoluteSpring(joints[-1], joint.get("rest", 0.0), joint["stiffness"]))
    for spring in scene.data["forces"]:
        plant.AddForceElement(
            LinearSpringDamper(
                bodies[spring["body_a"]],
                spring["point_a"],
                bodies[spring["body_b"]],
                spring["point_b"],
                spring["rest_length"],
                spring["k"],
                spring["c"],
            )
        )
    for loop in scene.data["loops"]:
        plant.AddBallConstraint(bodies[loop["body_a"]], loop["point_a"], bodies[loop["body_b"]], loop["point_b"])
    driven = [k for k, torque in enumerate(scene.torques) if torque]
    for k in driven:
        plant.AddJointActuator(f"a{k}", joints[k])
    plant.mutable_gravity_field().set_gravity_vector(scene.data["gravity"])
    plant.Finalize()
    if driven:
        torques = np.array([scene.torques[k] for k in driven])
        if scene.frequency:
            halves = np.arange(round(2 * scene.frequency * scene.end) + 2)
            signs = 1.0 - 2.0 * (halves % 2)
            source = builder.AddSystem(
                TrajectorySource(PiecewisePolynomial.ZeroOrderHold(halves / (2 * scene.frequency), np.outer(torques, signs)))
            )
        else:
            source = builder.AddSystem(ConstantVectorSource(torques))
        builder.Connect(source.get_output_port(), plant.get_actuation_input_port())
    log = LogVectorOutput(plant.get_state_output_port(), builder, publish_period=scene.step)
    diagram = builder.Build()
    return diagram, plant, joints, log


def main():
    scene = read(Path(sys.argv[1]))
    built = {}

    def run(method: str, value: float):
        plant_step = scene.step / value if method == "sap" else 0.0
        if plant_step not in built:
            built[plant_step] = build(scene, plant_step)
        diagram, plant, joints, log = built[plant_step]
        simulator = Simulator(diagram)
        if method != "sap":
            method, _, largest = method.partition(":")
            config = SimulatorConfig(
                integration_scheme=method, accuracy=value, max_step_size=float(largest) if largest else scene.step, use_error_control=True
            )
            ApplySimulatorConfig(config, simulator)
        context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        order = [joint.position_start() for joint in joints]
        start = {key: np.array(scene.data["initial"][key])[np.argsort(order)] for key in ("q", "qd")}
        plant.SetPositions(context, start["q"])
        plant.SetVelocities(context, start["qd"])
        simulator.Initialize()
        begin = time.process_time()
        simulator.AdvanceTo(scene.end)
        seconds = time.process_time() - begin
        rows = log.FindLog(simulator.get_context()).data().T
        rows = rows[:, order]
        if len(rows) == scene.rows:
            # the last output time is published by the following step
            rows = np.vstack([rows, plant.GetPositions(context)[order]])
        return seconds, rows

    serve(run)


if __name__ == "__main__":
    main()
