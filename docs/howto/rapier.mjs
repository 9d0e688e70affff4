// Rapier's JavaScript package (npm install @dimforge/rapier2d-compat) as an engine: the protocol of `adapters.pipe`.
import { createInterface } from "node:readline";
import RAPIER from "@dimforge/rapier2d-compat";

console.log = console.warn = () => {}; // answers alone may be written
await RAPIER.init();
const NAME = process.argv[2] ?? "rapierjs";
const SHAPES = ["disc", "box", "half_space"];
const HELLO = {
  protocol: 1,
  name: NAME,
  version: RAPIER.version(),
  facts: {
    title: "Rapier 2D, JavaScript",
    dimensions: [2],
    scheme: { order: "detect, then 4 substeps of velocity and position, restitution last", position_offset: 1 / 4 },
    customary_dt: 1 / 60,
    precision: "single",
    roles: { default: "shipped" },
  },
  profiles: {
    default: {
      substeps: { value: 4, because: "as shipped; each moves the bodies" },
      allowed_error: { value: 0.001, because: "as shipped: overlap that is not corrected" },
    },
  },
  expected: [
    {
      check: "spin",
      because: "contacts act before bodies touch; friction acts on each at its own surface, a gap apart",
      source: "measured with 0.21: a gap of 0.0088 m times 0.075 N s of friction is 0.00066 of the 0.00084 lost",
    },
  ],
};

function refuses(scene) {
  const strange = scene.bodies.find((body) => !SHAPES.includes(body.shape.type));
  if (strange) return `${strange.name}.shape: discs, boxes and half-spaces only`;
  if (scene.pairs.length) return "pairs: one material for all pairs only"; // hooks of this package cannot set them
  return null;
}

function collider({ type, radius, half_extents, normal }) {
  if (type === "disc") return RAPIER.ColliderDesc.ball(radius);
  if (type === "box") return RAPIER.ColliderDesc.cuboid(...half_extents);
  return RAPIER.ColliderDesc.halfspace(vector(normal));
}

const vector = ([x, y]) => ({ x, y });
const row = ({ x, y }) => [x, y];

class World {
  constructor(scene, dt, settings) {
    this.scene = scene;
    this.world = new RAPIER.World(vector(scene.gravity));
    this.world.timestep = dt;
    this.world.numSolverIterations = settings.substeps;
    this.world.integrationParameters.normalizedAllowedLinearError = settings.allowed_error;
    this.bodies = scene.bodies.map((body) => this.made(body));
  }

  made(body) {
    const { RigidBodyDesc } = RAPIER;
    const kind = { free: "dynamic", fixed: "fixed", prescribed: "kinematicVelocityBased" }[body.motion];
    const [x, y, angle] = body.pose, [vx, vy, spin] = body.twist, { shape } = body;
    const place = shape.type === "half_space" ? shape.normal.map((n) => n * shape.offset) : [x, y];
    const asked = RigidBodyDesc[kind]().setTranslation(...place).setRotation(angle).setCanSleep(false);
    if (body.motion === "free") asked.setAdditionalMassProperties(body.mass, { x: 0, y: 0 }, body.inertia);
    const made = this.world.createRigidBody(asked.setLinvel(vx, vy).setAngvel(spin));
    const { restitution, friction } = this.scene.material;
    this.world.createCollider(collider(shape).setDensity(0).setRestitution(restitution).setFriction(friction), made);
    if (body.motion === "free") {
      made.recomputeMassPropertiesFromColliders();
      made.addForce(vector(body.force), true);
      made.addTorque(body.torque[0], true);
    }
    return made;
  }

  read() {
    const origin = this.scene.bodies.map(({ shape }) => shape.type === "half_space");
    const pose = this.bodies.map((b, k) => (origin[k] ? [0, 0, 0] : [...row(b.translation()), b.rotation()]));
    const twist = this.bodies.map((b) => (b.isFixed() ? [0, 0, 0] : [...row(b.linvel()), b.angvel()]));
    return { pose, twist, contacts: this.contacts() };
  }

  contacts() {
    const found = [], colliders = this.bodies.map((body) => body.collider(0));
    for (let i = 0; i < colliders.length; i++) {
      for (let j = i + 1; j < colliders.length; j++) {
        this.world.contactPair(colliders[i], colliders[j], (manifold, flipped) => {
          const sign = flipped ? -1 : 1, normal = row(manifold.normal()).map((n) => sign * n), [x, y] = normal;
          for (let k = 0; k < manifold.numSolverContacts(); k++) {
            const push = manifold.contactImpulse(k), drag = manifold.contactTangentImpulse(k);
            const impulse = [push * x - drag * y, push * y + drag * x];
            const point = row(manifold.solverContactPoint(k)), gap = manifold.contactDist(k);
            found.push({ bodies: [i, j], point, normal, impulse, gap });
          }
        });
      }
    }
    return found;
  }
}

let held = null;
const ANSWERS = {
  hello: () => HELLO,
  refuses: ({ scene }) => ({ refuses: refuses(scene) }),
  build({ scene, dt, settings }) {
    held?.world.free();
    held = new World(scene, dt, settings);
    const { world } = held, readback = { dt: world.timestep, substeps: world.numSolverIterations };
    return { ...held.read(), readback: { ...readback, gravity: row(world.gravity) } };
  },
  step({ steps }) {
    for (let k = 0; k < steps; k++) held.world.step();
    return held.read();
  },
};
for await (const line of createInterface({ input: process.stdin })) {
  const asked = JSON.parse(line);
  process.stdout.write(JSON.stringify({ id: asked.id, ...ANSWERS[asked.ask](asked) }) + "\n");
}
