// node world_states.js ENGINE WORLD SCENES STEPS: the states of scenes after so many steps, by the engine of pages.
// SCENES is a file, a list of { dt, tolerance, model }; printed is a list of poses and velocities in Base64.
"use strict";
const fs = require("node:fs");
const path = require("node:path");

const [engine, world, scenes, steps] = process.argv.slice(2);
const { World } = require(path.resolve(world));
const base64 = (numbers) => Buffer.from(numbers.buffer, numbers.byteOffset, numbers.byteLength).toString("base64");

// As in the page, whose engine loads nothing either.
const wasmBinary = fs.readFileSync(engine.replace(/js$/, "wasm"));
require(path.resolve(engine))({ wasmBinary }).then((loaded) => {
  const states = JSON.parse(fs.readFileSync(scenes, "utf8")).map((scene) => {
    const it = new World(loaded, scene.model, scene);
    for (let k = 0; k < Number(steps); ++k) it.step();
    const state = { poses: base64(it.poses()), velocities: base64(it.velocities()), residual: it.report().residual };
    it.close();
    return state;
  });
  console.log(JSON.stringify(states));
});
