"""What makes a closed scene a whole one: forces in joints and between points, ports, prescribed joints, velocities, inputs."""

from __future__ import annotations

import math

import numpy as np

from tests.crosscheck.dense_motion import Dense, independent, lower_solve, orthonormal, scaled_levers
from tests.crosscheck.dense_scene import FREEDOMS, SLIDE, TURN, Scene
from tests.crosscheck.scene_maker import G, Maker

MOTION = ("motion", "locked")


def has_ball(joint: str) -> bool:
    return joint in ("spherical", "free")


def loads(m: Maker) -> dict[str, float]:
    """The weight of what each link carries, itself included."""
    weight = {link["name"]: link.get("mass", 0.0) * G for link in m.links}
    for link in reversed(m.links):
        if link["parent"] != "ground":
            weight[link["parent"]] += weight[link["name"]]
    return weight


def give_passive(m: Maker) -> None:
    """Springs, dampers, friction, stops and armatures in joints."""
    weight = loads(m)
    for link in m.links:
        kinds = [kind for kind, _ in FREEDOMS[link["joint"]]]
        if not kinds or has_ball(link["joint"]):
            continue
        size, F = m.sizes[link["name"]], weight[link["name"]]
        # unit of position, velocity and force of each freedom
        units = [(1.0, math.sqrt(G / size), F * size) if kind == TURN else (size, math.sqrt(G * size), F) for kind in kinds]
        fields = {}
        if m.chance(0.3):
            fields["damping"] = [m.between(0.01, 1) * T / v for _, v, T in units]
        if m.chance(0.3):
            fields["stiffness"] = [m.between(0.1, 3) * T / x for x, _, T in units]
            fields["rest"] = [m.between(-1, 1) * x for x, _, _ in units]
        if m.chance(0.2):
            fields["armature"] = [
                m.between(0.01, 0.3) * T / (G if kind == SLIDE else v * v) for (_, v, T), kind in zip(units, kinds, strict=True)
            ]
        if m.chance(0.2):
            fields["friction"] = [m.between(0.1, 0.5) * T for _, _, T in units]
            fields["friction_velocity"] = [m.between(0.3, 2) * v for _, v, _ in units]
            if m.chance(0.5):
                fields["static_friction"] = [m.between(1, 2) * f for f in fields["friction"]]
        if m.chance(0.15):
            give_stops(m, link, fields, units)
        for key, values in fields.items():
            if m.degrees and key in ("rest", "friction_velocity", "lower", "upper", "stop_width"):
                values = [math.degrees(v) if kind == TURN else v for v, kind in zip(values, kinds, strict=True)]
            link[key] = values if len(kinds) > 1 else values[0]


def give_stops(m: Maker, link: dict, fields: dict, units: list) -> None:
    dofs = m.scene().links[m.scene().index[link["name"]]].dofs
    q = [float(m.scene().dofs[k].fields["q"]) for k in dofs]
    fields["lower"] = [at - m.between(-0.3, 1) * x for at, (x, _, _) in zip(q, units, strict=True)]
    fields["upper"] = [low + m.between(0.4, 1) * x for low, (x, _, _) in zip(fields["lower"], units, strict=True)]
    fields["stop_stiffness"] = [m.between(0.1, 20) * T / x for x, _, T in units]
    fields["stop_damping"] = [m.between(0, 1) / v for _, v, _ in units]
    fields["stop_width"] = [m.between(0.1, 1) * x for x, _, _ in units]


def give_springs(m: Maker) -> None:
    weight = loads(m)
    for k in range(m.pick([0, 0, 1, 2])):
        a, b = m.pick(["ground", *m.sizes]), m.pick(list(m.sizes))
        rigid = m.rigid_to(a)
        if b in rigid or b == "ground":
            continue
        size = min(m.sizes[a], m.sizes[b])
        F = min(weight[name] for name in (a, b) if name != "ground")
        m.file["spring"].append(
            {
                "name": f"spring{k}",
                "link_a": a,
                "link_b": b,
                "point_a": m.numbers(m.vector(size)),
                "point_b": m.numbers(m.vector(size)),
                "stiffness": m.between(0.1, 5) * F / size,
                "damping": m.between(0, 1) * F / math.sqrt(G * size),
                "rest_length": m.between(0, 1) * size,
            }
        )


def give_couplings(m: Maker) -> None:
    """Rigid and elastic couplings of two to four joints with one freedom, satisfied at the start."""
    scene = m.scene()
    state = scene.start()
    for c in range(m.pick([0, 0, 0, 1, 1, 2])):
        first = m.pick(range(len(scene.dofs)))
        size = m.sizes[scene.links[scene.dofs[first].link].name]
        near = [k for k, dof in enumerate(scene.dofs) if dof.part is None and 0.1 < m.sizes[scene.links[dof.link].name] / size < 10]
        if len(near) < 2:
            continue
        chosen = list(m.rng.permutation(near)[: m.pick([2, 2, 3, 4])])
        dofs = [scene.dofs[k] for k in chosen]
        ratios = [m.pick([-1, 1]) * m.between(0.3, 3) / (1 if dof.turns else size) for dof in dofs]
        offset = sum(ratio * float(state[dof.variable("q")]) for ratio, dof in zip(ratios, dofs, strict=True))
        table = {"name": f"coupling{c}", "joints": [dof.name for dof in dofs], "ratios": ratios, "offset": offset}
        if m.chance(0.3):
            weight = loads(m)
            F = min(weight[scene.links[dof.link].name] for dof in dofs) * size
            table |= {"stiffness": m.between(0.1, 10) * F, "damping": m.between(0, 1) * F * math.sqrt(size / G)}
            if m.chance(0.5):
                table["backlash"] = m.between(0.01, 1)
                table["offset"] += m.between(-1, 1)
            if m.chance(0.3):
                table["width"] = m.between(0.01, 0.3) if "backlash" in table else None
        m.file["coupling"].append({key: value for key, value in table.items() if value is not None})
        m.tags.add("coupled")


def give_bushings(m: Maker) -> None:
    """Drawn apart, as contacts are."""
    rng = np.random.default_rng(m.rng.bit_generator.seed_seq.spawn(1)[0])
    weight = loads(m)
    for k in range(rng.choice([0, 0, 1, 2])):
        a, b = (str(name) for name in (rng.choice(["ground", *m.sizes]), rng.choice(list(m.sizes))))
        if b in m.rigid_to(a) or b == "ground":
            continue
        size = min(m.sizes[name] for name in (a, b) if name in m.sizes)
        F = min(weight[name] for name in (a, b) if name != "ground")
        unit = np.array([F / size] * 3 + [F * size] * 3)
        table = {"name": f"bushing{k}", "link_a": a, "link_b": b}
        for end in ("a", "b"):
            table[f"point_{end}"] = m.numbers(rng.normal(size=3) * 0.5 * size)
            table[f"rpy_{end}"] = [m.angle(angle) for angle in rng.uniform(-3, 3, 3)]
        table["stiffness"] = [float(x) for x in rng.uniform(0, 5, 6) * unit]
        table["damping"] = [float(x) for x in rng.uniform(0, 1, 6) * unit / math.sqrt(G / size)]
        m.file["bushing"].append(table)


def give_frames(m: Maker) -> None:
    for k in range(m.pick([0, 0, 1, 2])):
        link = m.pick(m.links)["name"]
        if link in m.rigid_to("ground"):
            continue
        m.file["frame"].append(
            {
                "name": f"frame{k}",
                "link": link,
                "position": m.numbers(m.vector(0.5 * m.sizes[link])),
                "rpy": [m.angle(m.between(-3, 3)) for _ in range(3)],
                "port": m.pick(["ground", "frame"]),
                "outputs": ["pose", "velocity", "acceleration", "imu"],
            }
        )
    give_wrist(m)


def give_wrist(m: Maker) -> None:
    """Wrench sensors on fixed links; drawn apart, so that other contents do not depend on them."""
    rng = np.random.default_rng(m.rng.bit_generator.seed_seq.spawn(1)[0])
    for k, link in enumerate(link for link in m.links if link["joint"] == "fixed"):
        table = {
            "name": f"wrist{k}",
            "link": link["name"],
            "outputs": ["wrench"],
            "position": m.numbers(rng.normal(size=3) * m.sizes[link["name"]]),
        }
        m.file["frame"].append(table | {"rpy": [m.angle(a) for a in rng.uniform(-3, 3, 3)]})


def rank(dense: Dense, columns: list[int]) -> int:
    return len(independent(scaled_levers(dense.rows.J[:, columns], dense.rows.lever[:, columns])[0])[0])


def give_drives(m: Maker, dense: Dense) -> None:
    """Prescribed joints, as many as the loops leave degrees of freedom; sometimes one more."""
    wanted = m.pick([0, 0, 0, 1, 1, 2, 3, 100])
    inverse = m.chance(0.1)
    extra = m.chance(0.05)
    free = list(range(len(dense.scene.dofs)))
    full = rank(dense, free)
    order = list(m.links)
    m.rng.shuffle(order)
    by_name = {link.name: link for link in dense.scene.links}
    for link in order:
        if link["joint"] == "fixed":
            continue
        if m.chance(0.3) or inverse:
            link["drive"] = "free"
        if has_ball(link["joint"]) or wanted == 0:
            continue
        left = [k for k in free if k not in by_name[link["name"]].dofs]
        if rank(dense, left) < full and not extra:
            continue
        if rank(dense, left) < full:
            extra = False
            m.tags.add("surplus")
        free, wanted = left, wanted - 1
        link["drive"] = "motion" if m.chance(0.8) else "locked"
        if inverse and link["drive"] == "motion":
            del link["drive"]
        m.tags.add("prescribed")
    if inverse:
        m.file["inverse"] = True
        m.tags.add("inverse")


def give_velocities(m: Maker, dense: Dense) -> None:
    """Velocities in the null space of the loops, written into the links."""
    s = dense.scene
    if m.chance(0.1):
        return
    locked = {link["name"] for link in m.links if link.get("drive") == "locked"}
    speed = []
    for dof in s.dofs:
        size = m.sizes[s.links[dof.link].name]
        speed.append((math.sqrt(G / size) if dof.turns else math.sqrt(G * size)) if s.links[dof.link].name not in locked else 0.0)
    free = [k for k, v in enumerate(speed) if v]
    d = np.array([speed[k] for k in free], np.longdouble)
    A, _ = scaled_levers(dense.rows.J[:, free], dense.rows.lever[:, free])
    chosen, _, _ = independent(A)
    y = np.array([m.between(-1.5, 1.5) for _ in free], np.longdouble)
    Q, _ = orthonormal((dense.rows.J[np.ix_(chosen, free)] * d).T if chosen else np.zeros((len(free), 0), np.longdouble), dense.n)
    for _ in range(2):
        y = y - Q @ (Q.T @ y)
    v = np.zeros(len(s.dofs), np.longdouble)
    y[abs(y) < 1e-14] = 0  # what rounding leaves where nothing can move
    v[free] = d * y
    wrong = m.chance(0.1) and not {"prescribed", "inverse"} & m.tags  # the FMU projects them
    if wrong:
        m.tags.add("projected")
        v *= m.rng.uniform(0.5, 1.5, len(v))
    for link, table in zip(s.links, [next(t for t in m.links if t["name"] == link.name) for link in s.links], strict=True):
        if not link.dofs or table["name"] in locked:
            continue
        values = [float(v[k] / s.unit) if s.dofs[k].turns else float(v[k]) for k in link.dofs]
        table["qd"] = values if len(values) > 1 else values[0]


def guide(m: Maker, inputs: dict, scene: Scene) -> None:
    """Gives some prescribed joints a trajectory in place of inputs."""
    for dof in scene.dofs:
        if dof.drive != "motion" or not m.chance(0.3):
            continue
        q, qd, qdd = [inputs.pop(dof.variable(what)) for what in ("q", "qd", "qdd")]
        unit = float(scene.unit) if dof.turns else 1.0
        course = {"joint": dof.name, "type": "polynomial", "coefficients": [q / unit, qd / unit, 0.5 * qdd / unit]}
        m.file["trajectory"].append(course)
        m.tags.add("guided")


def draw_inputs(m: Maker, scene: Scene) -> dict[str, float]:
    """Forces of drives and ports, and prescribed motions that go on from the start."""
    weight, inputs = loads(m), {}
    state = scene.start()
    for dof in scene.dofs:
        name = scene.links[dof.link].name
        size, F = m.sizes[name], weight[name]
        if dof.drive == "torque" and m.chance(0.7):
            inputs[dof.variable("tau")] = m.between(-1, 1) * (F * size if dof.turns else F)
        if dof.drive == "motion":
            inputs[dof.variable("q")], inputs[dof.variable("qd")] = float(state[dof.variable("q")]), float(state[dof.variable("qd")])
            inputs[dof.variable("qdd")] = m.between(-1, 1) * (G / size if dof.turns else G)
    for frame in m.file["frame"]:
        if "port" not in frame:
            continue
        size, F = m.sizes[frame["link"]], weight[frame["link"]]
        for k in (1, 2, 3):
            inputs[f"{frame['name']}.force[{k}]"] = m.between(-1, 1) * F
            inputs[f"{frame['name']}.torque[{k}]"] = m.between(-1, 1) * F * size
    return inputs


def agree(dense: Dense, inputs: dict) -> None:
    """Makes surplus prescribed accelerations agree with the loops: the nearest that do."""
    s, n = dense.scene, dense.n
    s.move(s.start())
    dense.solve(s.start(), inputs)
    rows = dense.rows
    wanted = np.array([n.one(inputs.get(dof.variable("qdd"), 0)) for dof in s.dofs])
    weight = np.array([1.0 if dof.drive != "locked" else 0.0 for dof in s.dofs])
    size = np.array([abs(w) if w else 1 for w in wanted])
    free = [k for k in range(len(weight)) if weight[k]]
    A, _ = scaled_levers(rows.J[:, free], rows.lever[:, free])
    chosen, _, _ = independent(A)
    J = rows.J[np.ix_(chosen, free)] * size[free]
    Q, R = orthonormal(J.T, n)
    left = rows.rhs[chosen] - rows.J[np.ix_(chosen, free)] @ wanted[free]
    wanted[free] += size[free] * (Q @ lower_solve(R.T, left))
    for k, dof in enumerate(s.dofs):
        if dof.drive == "motion":
            inputs[dof.variable("qdd")] = float(wanted[k])
