// The picture: bodies, forces, the camera, and what the pointer does. The z axis points up.
"use strict";

const FORCE_COLOUR = 0x2f8f4e;
const PULL_COLOUR = 0xd8432f;

class Stage {
  // hooks: grab(body, point) says whether the body can be pulled; pull(point); drop(). Points are arrays, m.
  constructor(canvas, hooks) {
    this.canvas = canvas;
    this.hooks = hooks;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    this.renderer.shadowMap.enabled = true;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(40, 1, 0.01, 1000);
    this.camera.up.set(0, 0, 1);
    this.target = new THREE.Vector3();
    this.sun = new THREE.DirectionalLight(0xffffff, 2.2);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(2048, 2048);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8d8478, 1.6), this.sun, this.sun.target);
    this.forces = lines(FORCE_COLOUR);
    this.spring = lines(PULL_COLOUR);
    this.scene.add(this.forces, this.spring);
    this.ray = new THREE.Raycaster();
    this.pointers = new Map();
    for (const name of ["pointerdown", "pointermove", "pointerup", "pointercancel"])
      canvas.addEventListener(name, (event) => this[name](event));
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
    this.paint();
  }

  // Colours of the page, which follow the system's setting.
  paint() {
    this.scene.background = new THREE.Color(styleOf("--sky"));
    this.scene.fog?.color.copy(this.scene.background);
    this.world?.traverse((part) => part.userData.plane && part.material.color.copy(groundColour()));
  }

  show(model, view) {
    for (const group of [...(this.groups ?? []), this.world])
      group?.traverse((part) => {
        part.geometry?.dispose();
        part.material?.dispose();
      });
    if (this.world) this.scene.remove(this.world, ...this.groups);
    const { middle, reach } = extentOf(model);
    Object.assign(this, groupsOf(model, reach));
    this.scene.add(this.world, ...this.groups);
    this.reach = reach;
    this.scene.fog = new THREE.Fog(this.scene.background, 6 * reach, 24 * reach);
    this.target.copy(middle);
    this.distance = 3.3 * reach;
    [this.azimuth, this.elevation] = (view ?? [-60, 18]).map((angle) => (angle * Math.PI) / 180);
    this.camera.near = reach / 100;
    this.camera.far = 60 * reach;
    this.sun.target.position.copy(middle);
    this.sun.position.copy(middle).add(new THREE.Vector3(-0.6, -1, 2.2).multiplyScalar(1.5 * reach));
    const box = this.sun.shadow.camera;
    Object.assign(box, { left: -3 * reach, right: 3 * reach, top: 3 * reach, bottom: -3 * reach, far: 10 * reach });
    box.updateProjectionMatrix();
    this.sun.shadow.normalBias = reach / 200;
    this.move();
  }

  // poses: seven numbers per body.
  update(poses) {
    this.groups.forEach((group, i) => {
      const [x, y, z, w, a, b, c] = poses.subarray(7 * i, 7 * i + 7);
      group.position.set(x, y, z);
      group.quaternion.set(a, b, c, w);
    });
  }
  // forces: six numbers per contact, drawn both ways from its point; the longest is a quarter of the scene's size.
  drawForces(forces) {
    let most = 1e-12;
    for (let i = 0; i < forces.length; i += 6) most = Math.max(most, Math.hypot(...forces.subarray(i + 3, i + 6)));
    const scale = (0.25 * this.reach) / most;
    const ends = [];
    for (let i = 0; i < forces.length; i += 6)
      for (const sign of [-1, 1]) for (const k of [0, 1, 2]) ends.push(forces[i + k] + sign * scale * forces[i + 3 + k]);
    setLines(this.forces, ends);
  }
  render() {
    const held = this.held;
    setLines(this.spring, held ? [...this.groups[held.body].localToWorld(held.point.clone()).toArray(), ...held.to] : []);
    this.renderer.render(this.scene, this.camera);
  }

  move() {
    const flat = Math.cos(this.elevation) * this.distance;
    this.camera.position
      .set(flat * Math.cos(this.azimuth), flat * Math.sin(this.azimuth), Math.sin(this.elevation) * this.distance)
      .add(this.target);
    this.camera.lookAt(this.target);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
  }
  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    // The angle of view is that of the shorter side.
    const half = Math.tan((20 * Math.PI) / 180);
    this.camera.fov = (360 / Math.PI) * Math.atan(half / Math.min(1, this.camera.aspect));
    this.camera.updateProjectionMatrix();
  }
  // Where a point of the world is seen on the page, in pixels of the window.
  seen(point) {
    const at = new THREE.Vector3(...point).project(this.camera);
    const box = this.canvas.getBoundingClientRect();
    return [box.left + ((at.x + 1) / 2) * box.width, box.top + ((1 - at.y) / 2) * box.height];
  }
  aim(event) {
    const box = this.canvas.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * 2 - 1;
    const y = 1 - ((event.clientY - box.top) / box.height) * 2;
    this.ray.setFromCamera(new THREE.Vector2(x, y), this.camera);
  }

  // One pointer on a body pulls it in the plane that faces the camera, beside bodies it turns the camera; two
  // zoom and shift.
  pointerdown(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (this.pointers.size > 1) return this.drop();
    this.aim(event);
    const hit = this.ray.intersectObjects(this.groups)[0];
    if (!hit) return;
    const { body } = hit.object.userData;
    if (!this.hooks.grab(body, hit.point.toArray())) return;
    const facing = this.camera.getWorldDirection(new THREE.Vector3());
    const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(facing, hit.point);
    this.held = { body, plane, point: this.groups[body].worldToLocal(hit.point.clone()), to: hit.point.toArray() };
  }
  pointermove(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    this.pointers.set(event.pointerId, now);
    if (this.held) this.drag(event);
    else if (this.pointers.size === 1) this.turn(now[0] - before[0], now[1] - before[1]);
    else if (this.pointers.size === 2) this.pinch(event.pointerId, before, now);
  }
  pointerup(event) {
    this.pointers.delete(event.pointerId);
    this.drop();
  }
  pointercancel(event) {
    this.pointerup(event);
  }
  drag(event) {
    this.aim(event);
    const to = this.ray.ray.intersectPlane(this.held.plane, new THREE.Vector3());
    if (!to) return;
    this.held.to = to.toArray();
    this.hooks.pull(this.held.to);
  }
  drop() {
    if (this.held) this.hooks.drop();
    this.held = null;
  }
  turn(dx, dy) {
    this.azimuth -= dx / 150;
    this.elevation = Math.min(1.5, Math.max(-0.2, this.elevation + dy / 150));
    this.move();
  }
  pinch(moved, before, now) {
    const [other] = [...this.pointers].filter(([id]) => id !== moved).map(([, at]) => at);
    const apart = (at) => Math.hypot(at[0] - other[0], at[1] - other[1]) + 1;
    this.zoom(apart(before) / apart(now));
    const pixel = this.distance / this.canvas.clientHeight / 2;
    const right = new THREE.Vector3().setFromMatrixColumn(this.camera.matrixWorld, 0);
    const up = new THREE.Vector3().setFromMatrixColumn(this.camera.matrixWorld, 1);
    this.target.addScaledVector(right, -pixel * (now[0] - before[0])).addScaledVector(up, pixel * (now[1] - before[1]));
    this.move();
  }
  wheel(event) {
    event.preventDefault();
    this.zoom(Math.exp(event.deltaY / 1000));
  }
  zoom(factor) {
    this.distance = Math.min(20 * this.reach, Math.max(0.2 * this.reach, factor * this.distance));
    this.move();
  }
}

function lines(colour) {
  const made = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: colour, depthTest: false }));
  made.frustumCulled = false;
  made.renderOrder = 1;
  return made;
}
function setLines(made, ends) {
  made.visible = ends.length > 0;
  if (!made.visible) return;
  made.geometry.dispose();
  made.geometry = new THREE.BufferGeometry();
  made.geometry.setAttribute("position", new THREE.Float32BufferAttribute(ends, 3));
}
