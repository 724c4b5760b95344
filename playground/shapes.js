// Geometries of three.js for the shapes of a model, and the group of each body.
"use strict";

const COLOURS = {
  Box: 0xcf7a56,
  Sphere: 0x6f93b5,
  Capsule: 0x8b8b92,
  Cylinder: 0xa3967c,
  Ellipsoid: 0x8fac86,
  Hull: 0xc4ab68,
};
const FIXED = 0xb4afa6;

// The z axis is that of cylinders here, the y axis in three.js.
const upright = (geometry) => geometry.rotateX(Math.PI / 2);

const geometryOf = {
  Sphere: (s) => new THREE.SphereGeometry(s.radius, 32, 16),
  Ellipsoid: (s) => new THREE.SphereGeometry(1, 32, 16).scale(...s.radii),
  Box: (s) => new THREE.BoxGeometry(...s.half.map((length) => 2 * length)),
  Cylinder: (s) => upright(new THREE.CylinderGeometry(s.radius, s.radius, 2 * s.half_length, 32)),
  Capsule: (s) => upright(new THREE.CapsuleGeometry(s.radius, 2 * s.half_length, 8, 24)),
  Hull: (s) => triangles(s.vertices, s.triangles),
  Mesh: (s) => triangles(s.vertices, s.triangles),
  HeightField: (s) => triangles(...grid(s)),
};

// Flat faces: no corner is shared, so that each has the normal of its triangle.
function triangles(vertices, faces) {
  const geometry = new THREE.BufferGeometry();
  const corners = faces.flat().flatMap((k) => vertices[k]);
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
  geometry.computeVertexNormals();
  return geometry;
}

// Row r, column c of a height field lies at x = (c / (columns - 1) - 1/2) size_x, and y so along the rows.
function grid({ heights, size_x, size_y }) {
  const rows = heights.length;
  const columns = heights[0].length;
  const vertices = heights.flatMap((row, r) =>
    row.map((z, c) => [(c / (columns - 1) - 0.5) * size_x, (r / (rows - 1) - 0.5) * size_y, z]),
  );
  const faces = [];
  for (let r = 0; r + 1 < rows; ++r)
    for (let c = 0; c + 1 < columns; ++c) {
      const k = r * columns + c;
      faces.push([k, k + 1, k + columns + 1], [k, k + columns + 1, k + columns]);
    }
  return [vertices, faces];
}

function place(object, { position, rotation: [w, x, y, z] }) {
  object.position.set(...position);
  object.quaternion.set(x, y, z, w);
}

// Bodies of a kind differ a little in brightness: multiples of the golden ratio spread evenly.
function colourOf(kind, body, moves) {
  const colour = new THREE.Color(moves ? (COLOURS[kind] ?? FIXED) : FIXED);
  return colour.multiplyScalar(0.9 + 0.2 * ((body * 0.6180339887) % 1));
}

// A group per body, in their order, with its geoms; then one of the world. A plane has no end: it is a square
// that ends in the mist.
function groupsOf(model, reach) {
  const groups = model.bodies.map(() => new THREE.Group());
  const world = new THREE.Group();
  for (const geom of model.geoms) {
    const shape = model.shapes[geom.shape];
    const moves = geom.body >= 0 && model.bodies[geom.body].motion === "dynamic";
    const plane = shape.kind === "Plane";
    const geometry = plane ? new THREE.PlaneGeometry(60 * reach, 60 * reach) : geometryOf[shape.kind]?.(shape);
    if (!geometry) continue;
    const colour = plane ? groundColour() : colourOf(shape.kind, geom.body, moves);
    const side = shape.kind === "Mesh" || shape.kind === "HeightField" ? THREE.DoubleSide : THREE.FrontSide;
    const flatShading = shape.kind === "Hull" || shape.kind === "Mesh" || shape.kind === "HeightField";
    // What is fixed may hide what moves: it is glass.
    const glass = !moves && !plane && { transparent: true, opacity: 0.35, depthWrite: false };
    const look = { color: colour, side, flatShading, roughness: 0.8, ...glass };
    const mesh = new THREE.Mesh(geometry, new THREE.MeshStandardMaterial(look));
    place(mesh, geom.frame);
    mesh.castShadow = moves;
    mesh.receiveShadow = true;
    mesh.userData = { body: geom.body, plane };
    (geom.body < 0 ? world : groups[geom.body]).add(mesh);
  }
  return { groups, world };
}

const groundColour = () => new THREE.Color(styleOf("--ground"));
const styleOf = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// The ball around what moves at the start: its middle and how far it reaches from there (m).
function extentOf(model) {
  const box = new THREE.Box3();
  const { groups } = groupsOf(model, 1);
  groups.forEach((group, i) => {
    place(group, model.bodies[i].pose);
    box.expandByObject(group);
  });
  if (box.isEmpty()) box.set(new THREE.Vector3(-1, -1, 0), new THREE.Vector3(1, 1, 1));
  const ball = box.getBoundingSphere(new THREE.Sphere());
  return { middle: ball.center, reach: Math.max(ball.radius, 1e-3) };
}
