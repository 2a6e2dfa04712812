"""Simulates a job of `graspd eval --engine` in PyBullet or MuJoCo.

Usage: python simulate_displacement.py {pybullet,mujoco} JOB.json ANSWER.json

The job holds an object as convex pieces, hands as fixed triangle meshes in the object's frame, and falls: what is
simulated with every hand. The answer says how the object moved. Lengths are metres, angles radians.
`--check ENGINE` only imports the engine and prints its version.
"""

import json
import sys
import tempfile
from pathlib import Path

import numpy as np


def principal_axes(inertia):
    """Principal moments and a right-handed rotation whose columns are the axes."""
    moments, axes = np.linalg.eigh(np.array(inertia))
    if np.linalg.det(axes) < 0.0:
        axes[:, 2] = -axes[:, 2]
    return moments, axes


def quaternion_xyzw(rotation):
    """The unit quaternion of a rotation matrix, by the eigenvector of its largest eigenvalue (Bar-Itzhack)."""
    m = np.asarray(rotation)
    k = np.array(
        [
            [m[0, 0] - m[1, 1] - m[2, 2], m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] - m[1, 2]],
            [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]],
            [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], np.trace(m)],
        ]
    )
    return np.linalg.eigh(k)[1][:, 3]


def angle_between(first_xyzw, second_xyzw):
    cosine = abs(float(np.dot(first_xyzw, second_xyzw)))
    return 2.0 * float(np.arccos(min(1.0, cosine)))


def run_fall(fall, step, pose):
    """Steps until the fall is over; `pose` gives the centre of mass and an orientation (xyzw)."""
    start, first = pose()
    limits = fall.get("limits")
    displacement, rotation = np.zeros(3), 0.0
    for _ in range(fall["steps"]):
        step()
        center, orientation = pose()
        displacement = center - start
        rotation = angle_between(first, orientation)
        if not np.all(np.isfinite(displacement)):
            return {"displacement": [0.0, 0.0, 0.0], "rotation": 0.0, "lost": True, "diverged": True}
        if limits and (
            np.linalg.norm(displacement) > limits["displacement"] or rotation > limits["rotation"]
        ):
            return {"displacement": displacement.tolist(), "rotation": rotation, "lost": True}
    return {"displacement": displacement.tolist(), "rotation": rotation, "lost": False}


class PyBullet:
    """Hand: one concave triangle mesh. Object: a compound of convex hulls."""

    # Bullet grows shapes by this much [m]; its default of 1 mm would press every grasp in by 2 mm more.
    MARGIN = 1e-4

    def __init__(self, job, folder):
        import pybullet

        self.bullet = pybullet
        self.job = job
        pybullet.connect(pybullet.DIRECT)
        self.object_file = folder / "object.obj"
        center = np.array(job["object"]["center_of_mass"])
        # Bullet keeps inertia diagonal in the body's own axes: these are the principal ones.
        self.moments, self.axes = principal_axes(job["object"]["unit_inertia"])
        lines, first = [], 1
        for index, piece in enumerate(job["object"]["pieces"]):
            lines.append(f"o piece_{index}")
            vertices = (np.array(piece["vertices"]) - center) @ self.axes
            lines += ["v %.9f %.9f %.9f" % tuple(v) for v in vertices]
            lines += ["f %d %d %d" % tuple(first + i for i in face) for face in piece["faces"]]
            first += len(piece["vertices"])
        self.object_file.write_text("\n".join(lines) + "\n")

    @staticmethod
    def version():
        from importlib.metadata import version

        return "pybullet " + version("pybullet")

    def simulate(self, hand, fall):
        b = self.bullet
        b.resetSimulation()
        b.setPhysicsEngineParameter(
            fixedTimeStep=fall["time_step"],
            numSolverIterations=fall["solver_iterations"],
            numSubSteps=0,
            deterministicOverlappingPairs=1,
            restitutionVelocityThreshold=0.0,
        )
        b.setGravity(*fall["gravity"])
        shape = b.createCollisionShape(
            b.GEOM_MESH,
            vertices=hand["vertices"],
            indices=[i for face in hand["faces"] for i in face],
            flags=b.GEOM_FORCE_CONCAVE_TRIMESH,
        )
        fixed = b.createMultiBody(baseMass=0, baseCollisionShapeIndex=shape)
        shape = b.createCollisionShape(b.GEOM_MESH, fileName=str(self.object_file))
        body = b.createMultiBody(
            baseMass=fall["mass"],
            baseCollisionShapeIndex=shape,
            basePosition=self.job["object"]["center_of_mass"],
            baseOrientation=quaternion_xyzw(self.axes).tolist(),
        )
        b.changeDynamics(fixed, -1, lateralFriction=fall["friction"], restitution=fall["hand_restitution"],
                         collisionMargin=self.MARGIN)
        # Bullet multiplies the friction of the two; damping would hold back the free fall.
        b.changeDynamics(body, -1, lateralFriction=1.0, restitution=fall["object_restitution"],
                         linearDamping=0.0, angularDamping=0.0, collisionMargin=self.MARGIN,
                         localInertiaDiagonal=(self.moments * fall["mass"]).tolist(), activationState=4)

        def pose():
            position, orientation = b.getBasePositionAndOrientation(body)
            return np.array(position), np.array(orientation)

        return run_fall(fall, b.stepSimulation, pose)


class MuJoCo:
    """Hand and object: convex pieces, for this engine takes the hull of any mesh."""

    def __init__(self, job, folder):
        import mujoco

        self.mujoco = mujoco
        self.job = job

    @staticmethod
    def version():
        from importlib.metadata import version

        return "mujoco " + version("mujoco")

    def add_pieces(self, spec, body, pieces, name, friction):
        mujoco = self.mujoco
        for index, piece in enumerate(pieces):
            mesh = spec.add_mesh()
            mesh.name = f"{name}_{index}"
            mesh.uservert = np.array(piece["vertices"], dtype=float).flatten()
            mesh.userface = np.array(piece["faces"], dtype=np.int32).flatten()
            # Thin pieces have hardly any volume, which the compiler of the model takes for a fault.
            mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
            geom = body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh.name)
            geom.friction = [friction, 0.0, 0.0]
            geom.condim = 3
            geom.mass = 0.0
            # Hand and object meet; the hand's pieces do not meet each other, nor do the object's.
            geom.contype, geom.conaffinity = (1, 0) if name == "hand" else (0, 1)

    def model(self, hand, fall):
        mujoco = self.mujoco
        spec = mujoco.MjSpec()
        spec.option.timestep = fall["time_step"]
        spec.option.gravity = fall["gravity"]
        spec.option.iterations = fall["solver_iterations"]
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        # Friction is soft, too, in this engine: this much stiffer than normal forces, it creeps little.
        spec.option.impratio = 10.0
        self.add_pieces(spec, spec.worldbody, hand["pieces"], "hand", fall["friction"])
        body = spec.worldbody.add_body(name="object")
        body.add_freejoint()
        inertia = np.array(self.job["object"]["unit_inertia"]) * fall["mass"]
        body.explicitinertial = True
        body.mass = fall["mass"]
        body.ipos = self.job["object"]["center_of_mass"]
        body.fullinertia = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
        self.add_pieces(spec, body, self.job["object"]["pieces"], "object", fall["friction"])
        return spec.compile()

    def prepare(self, hand):
        self.hand_model = self.model(hand, self.job["falls"][0])

    def simulate(self, hand, fall):
        mujoco, model = self.mujoco, self.hand_model
        model.opt.timestep = fall["time_step"]
        model.opt.gravity[:] = fall["gravity"]
        model.opt.iterations = fall["solver_iterations"]
        model.geom_friction[:, 0] = fall["friction"]
        index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "object")
        inertia_scale = fall["mass"] / model.body_mass[index]
        model.body_mass[index] *= inertia_scale
        model.body_inertia[index] *= inertia_scale
        data = mujoco.MjData(model)
        mujoco.mj_setConst(model, data)
        mujoco.mj_resetData(model, data)
        mujoco.mj_forward(model, data)

        def pose():
            q = data.xquat[index]
            return data.xipos[index].copy(), np.array([q[1], q[2], q[3], q[0]])

        def step():
            mujoco.mj_step(model, data)
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)

        return run_fall(fall, step, pose)


ENGINES = {"pybullet": PyBullet, "mujoco": MuJoCo}


def main(arguments):
    if len(arguments) == 2 and arguments[0] == "--check":
        __import__(arguments[1])
        print(ENGINES[arguments[1]].version())
        return
    name, job_file, answer_file = arguments
    job = json.loads(Path(job_file).read_text())
    with tempfile.TemporaryDirectory() as folder:
        engine = ENGINES[name](job, Path(folder))
        motions = []
        for hand in job["hands"]:
            if hasattr(engine, "prepare"):
                engine.prepare(hand)
            motions.append([engine.simulate(hand, fall) for fall in job["falls"]])
    answer = {"engine": ENGINES[name].version(), "motions": motions}
    Path(answer_file).write_text(json.dumps(answer))


if __name__ == "__main__":
    main(sys.argv[1:])
