"""Exudyn's kinematic tree (joint coordinates) with its solvers, for work_precision.py (see serve.hpp).

    python exudyn_peer.py SCENE.json

Methods: RK44, RK67 and GeneralizedAlpha or TrapezoidalIndex2, value: number of steps per output step; DOPRI5 with
automatic step size, value: its tolerance. Sensors record the rows in memory, so Python runs once per simulation.
"""

import sys
import time
from pathlib import Path

import exudyn as exu
import numpy as np
from exudyn.utilities import (
    GenericJoint,
    LoadCoordinate,
    MarkerBodyRigid,
    MarkerKinematicTreeRigid,
    MarkerNodeCoordinate,
    NodeGenericODE2,
    ObjectGround,
    ObjectKinematicTree,
    SensorNode,
    SpringDamper,
)
from scenes import Scene, read
from worker import serve


def matrix(inertia: list[float]) -> list[list[float]]:
    xx, yy, zz, xy, xz, yz = inertia
    return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]


def build(scene: Scene):
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    data, n = scene.data, scene.joints
    node = mbs.AddNode(
        NodeGenericODE2(
            referenceCoordinates=[0.0] * n,
            initialCoordinates=data["initial"]["q"],
            initialCoordinates_t=data["initial"]["qd"],
            numberOfODE2Coordinates=n,
        )
    )
    bodies = data["bodies"]
    joints = [body["joint"] for body in bodies]
    tree = mbs.AddObject(
        ObjectKinematicTree(
            nodeNumber=node,
            jointTypes=[exu.JointType.RevoluteZ if joint["type"] == "revolute" else exu.JointType.PrismaticZ for joint in joints],
            linkParents=[body["parent"] for body in bodies],
            jointTransformations=exu.Matrix3DList([np.array(joint["placement"]["R"]) for joint in joints]),
            jointOffsets=exu.Vector3DList([joint["placement"]["p"] for joint in joints]),
            linkInertiasCOM=exu.Matrix3DList([np.array(matrix(body["inertia"])) for body in bodies]),
            linkCOMs=exu.Vector3DList([body["com"] for body in bodies]),
            linkMasses=[body["mass"] for body in bodies],
            gravity=data["gravity"],
        )
    )
    ground = mbs.AddObject(ObjectGround())

    def marker(body: int, point: list[float]) -> int:
        if body < 0:
            return mbs.AddMarker(MarkerBodyRigid(bodyNumber=ground, localPosition=point))
        return mbs.AddMarker(MarkerKinematicTreeRigid(objectNumber=tree, linkNumber=body, localPosition=point))

    for spring in data["forces"]:
        ends = [marker(spring[f"body_{side}"], spring[f"point_{side}"]) for side in "ab"]
        mbs.AddObject(SpringDamper(markerNumbers=ends, referenceLength=spring["rest_length"], stiffness=spring["k"], damping=spring["c"]))
    for loop in data["loops"]:
        ends = [marker(loop[f"body_{side}"], loop[f"point_{side}"]) for side in "ab"]
        closed = [int(any(abs(direction[axis]) > 0.5 for direction in loop["directions"])) for axis in range(3)]
        mbs.AddObject(GenericJoint(markerNumbers=ends, constrainedAxes=closed + [0, 0, 0]))
    for k, torque in enumerate(scene.torques):
        if torque and scene.frequency:
            # a load that switches is a Python function in Exudyn
            def wave(_mbs, t, load, frequency=scene.frequency):
                return load if frequency * t % 1 < 0.5 else -load

            mbs.AddLoad(
                LoadCoordinate(
                    markerNumber=mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=k)), load=torque, loadUserFunction=wave
                )
            )
        elif torque:
            mbs.AddLoad(LoadCoordinate(markerNumber=mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=k)), load=torque))
    sensor = mbs.AddSensor(SensorNode(nodeNumber=node, outputVariableType=exu.OutputVariableType.Coordinates, storeInternal=True))
    mbs.Assemble()
    return container, mbs, sensor


def main():
    scene = read(Path(sys.argv[1]))
    # separate Exudyn's messages from the answers
    exu.config.printToConsole = False
    container, mbs, sensor = build(scene)

    def run(method: str, value: float):
        settings = exu.SimulationSettings()
        integration = settings.timeIntegration
        integration.endTime = scene.end
        integration.verboseMode = 0
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = scene.step
        settings.solution.sensors.writeHeader = False
        settings.show.globalTimers = False
        solver = getattr(exu.DynamicSolverType, method)
        if method == "DOPRI5":
            integration.automaticStepSize = True
            integration.relativeTolerance = value
            integration.absoluteTolerance = value / 100
            integration.numberOfSteps = scene.rows
            integration.initialStepSize = scene.step / 100
            integration.minimumStepSize = 1e-12
        else:
            integration.automaticStepSize = False
            integration.adaptiveStep = False
            integration.numberOfSteps = scene.rows * int(value)
        # a loop may pass a singular configuration
        settings.linearSolver.ignoreSingularJacobian = scene.has_loops
        integration.explicit.computeEndOfStepAccelerations = False
        if method == "GeneralizedAlpha":
            integration.generalizedAlpha.spectralRadius = 0.9
        begin = time.process_time()
        good = mbs.SolveDynamic(settings, solverType=solver, showHints=False)
        seconds = time.process_time() - begin
        if not good:
            raise RuntimeError("the solver failed")
        rows = mbs.GetSensorStoredData(sensor)
        if method == "DOPRI5":
            # output times are the ends of its own steps: only the last row is at an output time of the scene
            shown = np.full((scene.rows + 1, scene.joints), np.nan)
            shown[[0, -1]] = rows[[0, -1], 1 : 1 + scene.joints]
            return seconds, shown
        if len(rows) != scene.rows + 1 or not np.allclose(rows[:, 0], np.arange(scene.rows + 1) * scene.step, atol=1e-9):
            raise RuntimeError(f"rows at unexpected times ({len(rows)} of {scene.rows + 1})")
        if not np.isfinite(rows).all():
            raise RuntimeError("no finite result")
        return seconds, rows[:, 1 : 1 + scene.joints]

    serve(run)


if __name__ == "__main__":
    main()
