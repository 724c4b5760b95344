// The engine as a class: a world of bodies in the memory of WebAssembly. It also runs in node, for the tests.
"use strict";

// The options that a page and a test start a world with: time step (s), tolerance (natural residual).
class World {
  // engine: what load_engine() of engine.js resolves to; json: the text of a model.
  constructor(engine, json, { dt, tolerance }) {
    this.engine = engine;
    const bytes = engine.lengthBytesUTF8(json) + 1;
    const text = engine._malloc(bytes);
    engine.stringToUTF8(json, text, bytes);
    this.world = engine._open_world(text, dt, tolerance);
    engine._free(text);
    this.demand(this.world);
    this.bodies = engine._count_bodies(this.world);
  }

  close() {
    this.engine._close_world(this.world);
    this.world = 0;
  }
  reset() {
    this.engine._reset_world(this.world);
  }
  // False if the state could not move on.
  step() {
    return this.engine._step_world(this.world) === 1;
  }
  setOptions(dt, tolerance) {
    this.demand(this.engine._set_options(this.world, dt, tolerance));
  }
  setMaterial(friction, restitution) {
    this.demand(this.engine._set_material(this.world, friction, restitution));
  }
  // Takes a body at a point of the world (m); false if it does not move freely.
  pull(body, point) {
    return this.engine._pull_body(this.world, body, ...point) === 1;
  }
  pullTo(point) {
    this.engine._pull_to(this.world, ...point);
  }
  letGo() {
    this.engine._pull_body(this.world, -1, 0, 0, 0);
  }

  // Views of the engine's memory, until the next step: seven numbers per body (m; w, x, y, z), six (m/s, rad/s).
  poses() {
    return this.numbers(this.engine._body_poses(this.world), 7 * this.bodies);
  }
  velocities() {
    return this.numbers(this.engine._body_velocities(this.world), 6 * this.bodies);
  }
  // Six numbers per contact that carries a force: point (m), force on the first body (N).
  forces() {
    const count = this.engine._count_forces(this.world);
    return this.numbers(this.engine._contact_forces(this.world), 6 * count);
  }
  report() {
    const [time, residual, sound, iterations, contacts, penetration] = this.numbers(
      this.engine._last_report(this.world),
      6,
    );
    return { time, residual, sound: sound === 1, iterations, contacts, penetration };
  }

  numbers(address, count) {
    return this.engine.HEAPF64.subarray(address / 8, address / 8 + count);
  }
  demand(done) {
    if (!done) throw new Error(this.message());
  }
  message() {
    return this.engine.UTF8ToString(this.engine._message());
  }
}

if (typeof module !== "undefined") module.exports = { World };
