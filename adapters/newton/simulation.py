"""One Newton model with a solver and its readings; a step is recorded once and replayed.

A step of XPBD has about thirty launches of kernels, which cost 1.2 ms of Python on a CPU. Warp records them into a
graph, as on GPUs, and replays the same launches on the same arrays in 0.03 ms, bit for bit.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.engine import Array, Contacts, EngineError, Row, Simulation
from adapters.isolation.quiet import quiet
from adapters.readback import free_parts, pair_materials
from adapters.scene import Body, Box, Capsule, HalfSpace, Hull, Scene, Sphere
from adapters.scene.drives import place_after, velocity_over
from adapters.scene.means import mean, means

#: Rotation of Newton's capsules, along z, to the scene's, along x (x, y, z, w).
ALONG_X = (0.0, 0.7071067811865476, 0.0, 0.7071067811865476)


@cache
def imported() -> tuple[Any, Any]:
    """Import Warp and Newton without their messages on the terminal."""
    import warp

    warp.config.log_level = warp.LOG_ERROR
    with quiet():  # about a missing GPU, which does not matter here
        warp.init()
    import newton
    from newton._src.geometry import narrow_phase

    # Every pipeline makes the same kernels again, from the same arguments: 80 ms, and memory that is never freed.
    for name in ("create_narrow_phase_kernel_gjk_mpr", "create_narrow_phase_primitive_kernel"):
        setattr(narrow_phase, name, cache(getattr(narrow_phase, name)))
    return warp, newton


def turned(quaternion: tuple[float, ...], spin: tuple[float, ...], time: float) -> Array:
    """Quaternion (w, x, y, z) after turning with ``spin`` [rad/s, world axes] for ``time`` [s]."""
    rate = float(np.linalg.norm(spin))
    w, x, y, z = quaternion
    if rate == 0.0:
        return np.array(quaternion)
    c, (a, b, d) = np.cos(0.5 * rate * time), np.sin(0.5 * rate * time) / rate * np.asarray(spin)
    return np.array(
        [
            c * w - a * x - b * y - d * z,
            c * x + a * w + b * z - d * y,
            c * y + b * w + d * x - a * z,
            c * z + d * w + a * y - b * x,
        ]
    )


class NewtonSimulation(Simulation):
    """One model on the CPU; free and driven bodies are Newton's, shapes of fixed ones belong to its world.

    Subclasses have another solver, with its own numbers and materials.
    """

    #: Whether the solver reports contact forces.
    tells_forces = True

    def __init__(self, scene: Scene, dt: float, settings: Mapping[str, Any]) -> None:
        warp, newton = imported()
        self.scene, self.dt, self.settings, self.warp = scene, dt, settings, warp
        self.restitutions, self.frictions = means(scene, "restitution") or [], means(scene, "friction") or []
        builder = newton.ModelBuilder(gravity=tuple(float(g) for g in scene.gravity))
        builder.rigid_gap = settings["gap"]
        #: Newton's index of each of the scene's bodies; -1 for fixed ones.
        self.numbers = [self._made(newton, builder, index, body) for index, body in enumerate(scene.bodies)]
        self.model: Any = self._finished(builder)
        self.room = self._room()
        self.pipeline: Any = newton.CollisionPipeline(self.model, rigid_contact_max=self.room)
        self.touching: Any = self.pipeline.contacts()
        self.solver: Any = self._solver(newton)
        self.told: Any = self.solver.observables({"contact_f"}, contacts=self.touching) if self.tells_forces else None
        self.now, self.next = self.model.state(), self.model.state()
        self.control: Any = self.model.control()
        # Views of the engine's own arrays: there are no copies on a CPU.
        self.place, self.speed = self.now.body_q.numpy(), self.now.body_qd.numpy()
        self._start()
        self.driven = [k for k, body in enumerate(scene.bodies) if is_driven(body)]
        self.steps = 0
        self.graph: Any = None

    # ---- the solver --------------------------------------------------------------------------------------------------

    def _room(self) -> int | None:
        """Most contacts; None: as the engine estimates."""
        return None

    def _materials(self, index: int) -> dict[str, float]:
        """Further numbers of a body's shape."""
        rubs = self.frictions[index] > 0.0
        names = {"mu_torsional": "torsional", "mu_rolling": "rolling"}
        return {theirs: self.settings[ours] if rubs else 0.0 for theirs, ours in names.items()}

    def _finished(self, builder: Any) -> Any:
        """The model of what was made."""
        return builder.finalize(device="cpu")

    def _solver(self, newton: Any) -> Any:
        """The solver of the model."""
        return newton.solvers.SolverXPBD(
            self.model,
            iterations=self.settings["iterations"],
            rigid_contact_relaxation=self.settings["relaxation"],
            rigid_contact_con_weighting=self.settings["weighted"],
            enable_restitution=self.settings["rebounds"],
            rigid_contact_restitution_iterations=self.settings["rebound_iterations"],
        )

    def _impulses(self, count: int) -> Array:
        """Impulses of the contacts of the last step on the first bodies [N s]; NaN where the solver tells none."""
        if self.told is None or self.settings.get("rebounds"):
            return np.full((count, 3), np.nan)
        return np.asarray(self.dt * self.told.contact_f.numpy()[:count, :3].astype(float))

    def _numbers(self) -> dict[str, Any]:
        """The solver's own numbers, as it holds them."""
        model, solver = self.model, self.solver
        return {
            "iterations": int(solver.iterations),
            "relaxation": float(solver.rigid_contact_relaxation),
            "weighted": bool(solver.rigid_contact_con_weighting),
            "rebounds": bool(solver.enable_restitution),
            "rebound_iterations": int(solver.rigid_contact_restitution_iterations),
            "torsional": [float(x) for x in model.shape_material_mu_torsional.numpy()],
            "rolling": [float(x) for x in model.shape_material_mu_rolling.numpy()],
        }

    # ---- making ------------------------------------------------------------------------------------------------------

    def _made(self, newton: Any, builder: Any, index: int, asked: Body) -> int:
        """Make body and shape of one of the scene's bodies; its index, or -1."""
        number, place = -1, self._transform(asked)
        if asked.motion == "free":
            inertia = self.warp.mat33(*np.diag(np.asarray(asked.inertia, float)).ravel())
            number = builder.add_body(xform=place, mass=asked.mass, inertia=inertia, lock_inertia=True)
        elif is_driven(asked):
            number = builder.add_body(xform=place, is_kinematic=True, lock_inertia=True)
        config = newton.ModelBuilder.ShapeConfig(
            density=0.0,
            mu=self.frictions[index],
            restitution=self.restitutions[index],
            **self._materials(index),
        )
        self._shape(newton, builder, number, asked, None if number >= 0 else place, config)
        return int(number)

    def _transform(self, asked: Body) -> Any:
        if isinstance(asked.shape, HalfSpace):
            return self.warp.transform_identity()
        w, x, y, z = asked.pose[3:]
        return self.warp.transform(asked.pose[:3], (x, y, z, w))

    def _shape(self, newton: Any, builder: Any, number: int, asked: Body, place: Any, config: Any) -> None:
        shape, warp = asked.shape, self.warp
        if isinstance(shape, HalfSpace):
            plane = (*(float(n) for n in shape.normal), -float(shape.offset))
            builder.add_shape_plane(plane=plane, width=0.0, length=0.0, body=number, cfg=config)
        elif isinstance(shape, Sphere):
            builder.add_shape_sphere(number, xform=place, radius=shape.radius, cfg=config)
        elif isinstance(shape, Capsule):
            along = warp.transform((0.0, 0.0, 0.0), ALONG_X)
            along = along if place is None else place * along
            builder.add_shape_capsule(
                number, xform=along, radius=shape.radius, half_height=shape.half_length, cfg=config
            )
        elif isinstance(shape, Hull):
            builder.add_shape_convex_hull(number, xform=place, mesh=_mesh(newton, shape), cfg=config)
        else:
            assert isinstance(shape, Box)
            x, y, z = shape.half_extents
            builder.add_shape_box(number, xform=place, hx=x, hy=y, hz=z, cfg=config)

    def _start(self) -> None:
        """Twists and loads of the scene; a state's forces remain until they are cleared."""
        loads = self.now.body_f.numpy()
        for asked, number in zip(self.scene.bodies, self.numbers, strict=True):
            if number < 0:
                continue
            self.speed[number] = asked.twist
            if asked.motion == "free":
                loads[number] = (*asked.force, *asked.torque)
            elif asked.motion == "fixed":
                self.speed[number] = (*asked.surface_velocity, 0.0, 0.0, 0.0)

    # ---- stepping ----------------------------------------------------------------------------------------------------

    def _solve(self) -> None:
        """One step of the solver: contacts at its start, then positions; the state is ready for the next."""
        self.pipeline.collide(self.now, self.touching)
        told = {} if self.told is None else {"observables": self.told}
        self.solver.step(self.now, self.next, self.control, self.touching, self.dt, **told)
        self.warp.copy(self.now.body_q, self.next.body_q)
        self.warp.copy(self.now.body_qd, self.next.body_qd)

    def advance(self, steps: int) -> None:
        """See `Simulation.advance`; a driven body gets its final pose first, because the others are projected."""
        if not len(self.place):
            self.steps += steps
            return
        for _ in range(steps):
            self.steps += 1
            for k in self.driven:
                self._lead(k)
            if self.graph is None:
                with self.warp.ScopedCapture(device="cpu") as capture:  # records the launches and makes none
                    self._solve()
                self.graph = capture.graph
            self.warp.capture_launch(self.graph)
        if self.room is not None and (found := int(self.touching.rigid_contact_count.numpy()[0])) > self.room:
            raise EngineError(f"contacts: {found} of them, and the model has room for {self.room}")

    def _lead(self, k: int) -> None:
        """Set a driven body's pose at the end of the next step, and its velocity."""
        body, number = self.scene.bodies[k], self.numbers[k]
        if body.motion == "fixed" or isinstance(body.shape, HalfSpace):
            return  # a surface that runs along itself does not move
        time = self.steps * self.dt
        self.place[number, :3] = place_after(body, time)
        w, x, y, z = turned(body.pose[3:], body.twist[3:], time)
        self.place[number, 3:] = (x, y, z, w)
        self.speed[number, :3] = velocity_over(body, self.dt, self.steps - 1)

    # ---- reading -----------------------------------------------------------------------------------------------------

    def pose(self) -> Array:
        """See `Simulation.pose`; a half-space's own pose is the scene's."""
        rows = np.array([body.pose for body in self.scene.bodies], float)
        for k, (body, number) in enumerate(zip(self.scene.bodies, self.numbers, strict=True)):
            if number >= 0 and not isinstance(body.shape, HalfSpace):
                rows[k, :3] = self.place[number, :3]
                rows[k, 3:] = self.place[number, [6, 3, 4, 5]]
        return rows

    def twist(self) -> Array:
        """See `Simulation.twist`; that of a prescribed body belongs to the last step."""
        rows = np.zeros((len(self.scene.bodies), 6))
        for k, (body, number) in enumerate(zip(self.scene.bodies, self.numbers, strict=True)):
            if number >= 0 and body.motion != "fixed":
                rows[k] = self.speed[number]
        return rows

    def contacts(self) -> Contacts:
        """Contacts of the last step; impulses of XPBD are those of positions, and unknown with restitution.

        Shapes are made in the order of bodies, one each, so a shape's index is its body's in the scene.
        """
        if self.graph is None:
            return Contacts.from_rows([], 3)
        held, count = self.touching, int(self.touching.rigid_contact_count.numpy()[0])
        impulses = self._impulses(count)
        shapes, local, offsets = (
            [part.numpy()[:count] for part in parts]
            for parts in (
                (held.rigid_contact_shape0, held.rigid_contact_shape1),
                (held.rigid_contact_point0, held.rigid_contact_point1),
                (held.rigid_contact_offset0, held.rigid_contact_offset1),
            )
        )
        margins = held.rigid_contact_margin0.numpy()[:count] + held.rigid_contact_margin1.numpy()[:count]
        normals = held.rigid_contact_normal.numpy()[:count].astype(float)
        bodies = self.model.shape_body.numpy()
        rows: list[Row] = []
        for k in range(count):
            numbers = [int(bodies[shapes[side][k]]) for side in (0, 1)]
            # Overlaps are measured between points inside the shapes, minus their thickness; offsets lead to surfaces.
            inner = [self._world(numbers[side], local[side][k]) for side in (0, 1)]
            outer = [self._world(numbers[side], local[side][k] + offsets[side][k]) for side in (0, 1)]
            gap = float(normals[k] @ (inner[1] - inner[0])) - float(margins[k])
            place = 0.5 * (outer[0] + outer[1])
            # The force acts on the first body; contacts out of range have none.
            rows.append((int(shapes[0][k]), int(shapes[1][k]), place, normals[k], -impulses[k], gap))
        return Contacts.from_rows(sorted(rows, key=lambda row: sorted(row[:2])), 3)

    def _world(self, number: int, point: Array) -> Array:
        if number < 0:
            return point
        x, y, z, w = self.place[number, 3:].astype(float)
        across = np.array([x, y, z])
        turned_point = point + 2.0 * np.cross(across, np.cross(across, point) + w * point)
        return np.asarray(self.place[number, :3].astype(float) + turned_point)

    def readback(self) -> dict[str, Any]:
        """Values of the model and its solver."""
        model = self.model
        mass, inertia = model.body_mass.numpy(), model.body_inertia.numpy()
        friction, restitution = model.shape_material_mu.numpy(), model.shape_material_restitution.numpy()
        return {
            "dt": self.dt,
            "gravity": [float(g) for g in model.gravity.numpy()[0]],
            "gap": [float(x) for x in model.shape_gap.numpy()],
            **self._numbers(),
            "bodies": {
                name: {
                    "mass": float(mass[number]),
                    "inertia": [float(inertia[number][axis][axis]) for axis in range(3)],
                }
                for name, number in free_parts(self.scene, self.numbers)
            },
            "pairs": pair_materials(self.scene, (restitution, mean), (friction, mean)),
        }


def is_driven(body: Body) -> bool:
    """Whether a body has a prescribed motion, or its surface runs."""
    return body.motion == "prescribed" or any(body.surface_velocity)


def _mesh(newton: Any, shape: Hull) -> Any:
    vertices = np.array(shape.vertices, np.float32)
    mesh = newton.Mesh(vertices, triangles(shape).ravel(), compute_inertia=False)
    if len(mesh.vertices) != len(vertices):
        raise EngineError(f"shape: newton uses {len(mesh.vertices)} of {len(vertices)} vertices")
    return mesh


def triangles(shape: Hull) -> NDArray[np.int32]:
    """Triangles around a hull, facing outwards: indices of their corners (n, 3)."""
    from scipy.spatial import ConvexHull

    vertices = np.array(shape.vertices, float)
    hull = ConvexHull(vertices)
    found = []
    for (i, j, k), plane in zip(hull.simplices, hull.equations, strict=True):
        outwards = np.cross(vertices[j] - vertices[i], vertices[k] - vertices[i]) @ plane[:3] > 0.0
        found.append((i, j, k) if outwards else (i, k, j))
    return np.array(found, np.int32)
