"""Kinematics of the drawing of a mechanism for films, as in the page."""

from __future__ import annotations

from typing import Any

import numpy as np


class Motion:
    """A drawing table (see `describe`) and the results that move it."""

    def __init__(self, drawing: dict[str, Any], columns: dict[str, np.ndarray]) -> None:
        self.drawing, self.columns = drawing, columns
        self.start = [_pose(link["rotation"], link["origin"]) for link in drawing["links"]]
        turning = [ball for ball in drawing.get("balls", []) if all(f"{ball['name']}.quaternion[{k}]" in columns for k in range(1, 5))]
        self.balls = {ball["link"]: ball for ball in turning}
        names = [link["name"] for link in drawing["links"]]
        self.carriers = {name: i for i, name in enumerate(names)}
        self.forces = {contact["name"]: self._columns(contact["name"]) for contact in drawing.get("contacts", [])}
        acting = [size for force, _ in filter(None, self.forces.values()) for size in np.linalg.norm(force, axis=0) if size > 0]
        self.strong = float(np.percentile(acting, 90)) if acting else 0.0  # N, of an arrow of full length

    def at(self, row: int) -> dict[str, Any]:
        """Returns the drawing table at a row of the run."""
        poses = self._poses(row)
        moves = [pose @ np.linalg.inv(start) for pose, start in zip(poses, self.start, strict=True)]
        links = [
            {**link, "origin": pose[:3, 3], "rotation": pose[:3, :3], "com": _moved(move, link["com"])}
            for link, pose, move in zip(self.drawing["links"], poses, moves, strict=True)
        ]
        ties = {kind: [self._tie(tie, moves) for tie in self.drawing.get(kind, [])] for kind in ("loops", "springs", "bushings")}
        contacts = [self._contact(contact, moves, row) for contact in self.drawing.get("contacts", [])]
        return {**self.drawing, "links": links, **ties, "contacts": contacts}

    def _poses(self, row: int) -> list[np.ndarray]:
        poses: list[np.ndarray] = []
        for i, link in enumerate(self.drawing["links"]):
            base, base_start = self._base(link["parent"], poses)
            relative = np.linalg.inv(base_start) @ self.start[i]
            if i in self.balls:
                ball = self.balls[i]
                turn = [self.columns[f"{ball['name']}.quaternion[{k}]"][row] for k in range(1, 5)]
                # remove the initial rotation, then apply the current one
                relative = relative @ np.linalg.inv(_turn(ball["quaternion"])) @ _turn(turn)
            elif (link["turn"] or link["slide"]) and f"{link['joint']}.q" in self.columns:
                relative = relative @ _joint(link, self.columns[f"{link['joint']}.q"][row] - link["q"])
            poses.append(base @ relative)
        return poses

    def _base(self, parent: int, poses: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        return (np.eye(4), np.eye(4)) if parent < 0 else (poses[parent], self.start[parent])

    def _tie(self, tie: dict[str, Any], moves: list[np.ndarray]) -> dict[str, Any]:
        points = {}
        for side in ("a", "b"):
            link, point = self.carriers.get(tie[f"link_{side}"]), tie[f"point_{side}"]
            points[f"point_{side}"] = point if link is None else _moved(moves[link], point)
        return {**tie, **points}

    def _columns(self, contact: str) -> tuple[np.ndarray, np.ndarray] | None:
        """Returns force and point over time (3 rows each), or None if the contact has no such outputs."""
        names = [[f"{contact}.{group}[{k}]" for k in (1, 2, 3)] for group in ("force", "point")]
        if not all(name in self.columns for group in names for name in group):
            return None
        force, point = (np.array([self.columns[name] for name in group]) for group in names)
        return force, point

    def _contact(self, contact: dict[str, Any], moves: list[np.ndarray], row: int) -> dict[str, Any]:
        moved = dict(contact)
        for side in ("a", "b"):
            link, shape = self.carriers.get(contact[side]["link"]), contact[side]
            if link is not None:
                # lists, as in the table: equal planes are drawn once
                rotation = (moves[link][:3, :3] @ np.asarray(shape["rotation"], float)).tolist()
                moved[side] = {**shape, "origin": _moved(moves[link], shape["origin"]).tolist(), "rotation": rotation}
        if self.forces[contact["name"]] is not None:
            force, point = (values[:, row] for values in self.forces[contact["name"]])
            if np.any(force != 0):
                # in multiples of the strongest tenth, at most twice as long
                share = force / self.strong
                moved["arrow"] = point, share * min(1.0, 2.0 / float(np.linalg.norm(share)))
        return moved


def _pose(rotation, origin) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, origin
    return pose


def _moved(move: np.ndarray, point) -> np.ndarray:
    return move[:3, :3] @ np.asarray(point, float) + move[:3, 3]


def _joint(link: dict[str, Any], moved: float) -> np.ndarray:
    """The displacement about and along z for a change of q."""
    pose = np.eye(4)
    c, s = np.cos(link["turn"] * moved), np.sin(link["turn"] * moved)
    pose[:2, :2] = [[c, -s], [s, c]]
    pose[2, 3] = link["slide"] * moved
    return pose


def _turn(quaternion) -> np.ndarray:
    w, x, y, z = np.asarray(quaternion, float) / (np.linalg.norm(quaternion) or 1.0)
    pose = np.eye(4)
    pose[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]  # fmt: skip
    return pose
