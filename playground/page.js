// The controls, and the loop that steps the world. make_playground.py puts the data into the page, packed.
"use strict";

let THREE;
const $ = (id) => document.getElementById(id);

// Gzip in Base64: a third of the bytes.
async function unpacked(id) {
  const bytes = Uint8Array.from(atob($(id).textContent.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}
const text = async (id) => new TextDecoder().decode(await unpacked(id));

// The modules of three.js from memory, since a page that was opened from a folder cannot load any.
async function loadThree() {
  const address = (source) => URL.createObjectURL(new Blob([source], { type: "text/javascript" }));
  const core = address(await text("three-core"));
  return import(address((await text("three")).replaceAll("./three.core.js", core)));
}
async function loadEngine() {
  const load = new Function(`${await text("engine")}; return load_engine;`)();
  return load({ wasmBinary: await unpacked("engine-wasm") });
}

// The sliders: a number from and to their position, and how it is written.
const two = (value) => Number(value.toPrecision(2));
const logarithmic = { number: (at) => two(10 ** at), position: Math.log10 };
const linear = { number: two, position: (value) => value };
const SLIDERS = {
  friction: { ...linear, shown: (v) => v.toFixed(2) },
  restitution: { ...linear, shown: (v) => v.toFixed(2) },
  dt: { ...logarithmic, shown: (v) => `${two(1e3 * v)} ms` },
  tolerance: { ...logarithmic, shown: (v) => v.toExponential(0) },
};

class Playground {
  constructor(engine, scenes) {
    this.engine = engine;
    this.scenes = scenes;
    this.stage = new Stage($("stage"), {
      grab: (body, point) => this.grab(body, point),
      pull: (point) => this.world.pullTo(point),
      drop: () => this.world.letGo(),
    });
    this.curve = new Curve($("curve"));
    for (const [k, { title }] of scenes.entries()) $("scene").add(new Option(title, k));
    $("scene").onchange = () => this.open(scenes[$("scene").value]);
    $("play").onclick = () => this.play(!this.playing);
    $("step").onclick = () => {
      this.play(false);
      this.step();
      this.show();
    };
    $("reset").onclick = () => this.reset();
    $("file").onchange = () => this.openFile($("file").files[0]).then(() => ($("file").value = ""));
    for (const name of Object.keys(SLIDERS)) $(name).oninput = () => this.change(name);
    $("forces").onchange = () => this.show();
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.stage.paint();
      this.show();
    });
    this.frame = this.frame.bind(this);
    this.open(scenes[0]);
    this.play(true);
    requestAnimationFrame(this.frame);
  }

  // scene: title, says, dt, tolerance, view (degrees), model: the text of amontons.write_model.
  open(scene) {
    const model = JSON.parse(scene.model);
    const world = new World(this.engine, scene.model, scene);
    this.world?.close();
    this.world = world;
    this.scene = scene;
    this.stage.drop();
    this.stage.show(model, scene.view);
    const moving = model.geoms.find((geom) => geom.body >= 0) ?? model.geoms[0];
    const { friction = 0.5, restitution = 0 } = moving?.material ?? {};
    this.settings = { friction, restitution, dt: scene.dt, tolerance: scene.tolerance };
    for (const [name, slider] of Object.entries(SLIDERS)) {
      $(name).value = slider.position(this.settings[name]);
      $(`${name}-value`).textContent = slider.shown(this.settings[name]);
    }
    $("says").textContent = scene.says;
    this.reset();
  }
  async openFile(file) {
    if (!file) return;
    try {
      this.open({ says: file.name, dt: 5e-3, tolerance: 1e-4, model: await file.text() });
      $("scene").value = "";
    } catch (error) {
      this.fail(`${file.name}: ${error.message}`);
    }
  }
  reset() {
    this.stage.drop();
    this.world.reset();
    this.curve.clear();
    this.due = this.cost = 0;
    this.fail("");
    this.show();
  }
  play(playing) {
    this.playing = playing;
    $("play").textContent = playing ? "Pause" : "Play";
    this.last = performance.now();
    this.due = 0;
  }
  change(name) {
    const slider = SLIDERS[name];
    this.settings[name] = slider.number(Number($(name).value));
    $(`${name}-value`).textContent = slider.shown(this.settings[name]);
    const { friction, restitution, dt, tolerance } = this.settings;
    try {
      if (name === "dt" || name === "tolerance") this.world.setOptions(dt, tolerance);
      else this.world.setMaterial(friction, restitution);
    } catch (error) {
      this.fail(error.message);
    }
    this.show();
  }
  grab(body, point) {
    const taken = this.world.pull(body, point);
    if (taken && !this.playing) this.play(true);
    return taken;
  }

  step() {
    const start = performance.now();
    if (!this.world.step()) {
      this.play(false);
      this.fail(this.world.message() || "The velocities are not finite: the state is that before the step.");
      return false;
    }
    const took = performance.now() - start;
    this.cost += 0.1 * (took - this.cost);
    const { residual, sound } = this.world.report();
    this.curve.add(residual, this.settings.tolerance, sound);
    return true;
  }
  // As many steps as the clock asks for, at most 30 ms of them: slower scenes run slower than real time.
  frame(now) {
    requestAnimationFrame(this.frame);
    if (this.playing) {
      this.due = Math.min(this.due + (now - this.last) / 1e3, 0.1);
      const end = performance.now() + 30;
      while (this.due >= this.settings.dt && performance.now() < end && this.step()) this.due -= this.settings.dt;
      this.show();
    }
    this.last = now;
    this.stage.render();
  }
  show() {
    this.stage.update(this.world.poses());
    this.stage.drawForces($("forces").checked ? this.world.forces() : []);
    this.curve.draw(this.settings.tolerance);
    const { time, residual, sound, iterations, contacts, penetration } = this.world.report();
    const told = {
      time: `${time.toFixed(2)} s`,
      residual: residual.toExponential(1) + (sound ? "" : " (missed)"),
      iterations,
      contacts,
      penetration: `${(1e3 * penetration).toPrecision(2)} mm`,
      cost: `${this.cost.toFixed(1)} ms`,
    };
    for (const [name, value] of Object.entries(told)) $(`told-${name}`).textContent = value;
  }
  fail(message) {
    $("fault").textContent = message;
  }
}

$("licences").ontoggle = async () => {
  $("licences").lastElementChild.textContent ||= await text("licence-texts");
};

async function start() {
  THREE = await loadThree();
  const scenes = JSON.parse(await text("scenes"));
  // Tests and the console of the browser reach it here.
  window.playground = new Playground(await loadEngine(), scenes);
  $("loading").remove();
}
start().catch((error) => {
  $("loading").textContent = `The playground cannot start here: ${error.message}`;
});
