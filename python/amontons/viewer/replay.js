// What a click on a body of a replay tells: its name, its mass, and what touches it in the frame that is shown.
//
// The page of viser has no server here. A click makes it send a message, which this script takes; the number of
// the frame is the x of a node that is not seen. `told` is put in by page.py.
(async () => {
  const told = /*amontons*/;
  const MOST = 12; // contacts that are listed
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const inflated = (text) =>
    new Response(new Blob([bytes(text)]).stream().pipeThrough(new DecompressionStream("deflate"))).json();
  const contacts = told.contacts === null ? null : await inflated(told.contacts);

  // The state of the page is a context of React; the container of the page knows the tree that holds it.
  const stateOf = () => {
    const root = document.getElementById("root");
    const key = root && Object.keys(root).find((name) => name.startsWith("__reactContainer"));
    const open = key ? [root[key]] : [];
    while (open.length) {
      const fiber = open.pop();
      const value = fiber.memoizedProps && fiber.memoizedProps.value;
      if (value && value.sceneTreeActions && value.mutable && value.mutable.current) return value;
      for (const next of [fiber.sibling, fiber.child]) if (next) open.push(next);
    }
    return null;
  };

  const box = document.createElement("div");
  box.id = "amontons-body";
  box.style.cssText =
    "position:fixed;right:1em;top:1em;z-index:500;display:none;padding:.6em .9em;border-radius:4px;" +
    "background:rgba(255,255,255,.92);color:#222;box-shadow:0 1px 6px rgba(0,0,0,.25);" +
    "font:13px/1.45 system-ui,sans-serif;min-width:14em;max-width:24em;white-space:pre-line;overflow-wrap:anywhere";
  const close = document.createElement("button");
  close.textContent = "×";
  close.setAttribute("aria-label", "Close");
  close.style.cssText = "float:right;margin:-.2em -.3em 0 .6em;border:0;background:none;font-size:16px;cursor:pointer";
  const name = document.createElement("b");
  const text = document.createElement("div");
  box.append(close, name, text);
  document.body.append(box);

  let chosen = null;
  close.onclick = () => {
    chosen = null;
    box.style.display = "none";
  };

  const nameOf = (body) => (body < 0 ? "the world" : told.bodies[body][0]);
  const show = (page) => {
    if (chosen === null) return;
    const pose = page.mutable.current.nodePoseData[told.clock];
    const frame = Math.min(Math.max(0, Math.round(pose ? pose.position[0] : 0)), told.times.length - 1);
    const lines = [told.bodies[chosen][1] + ", t = " + told.times[frame] + " s"];
    if (contacts === null) lines.push("contacts were not recorded");
    else {
      const mine = contacts[frame].filter((c) => c[0] === chosen || c[1] === chosen).sort((a, b) => b[2] - a[2]);
      lines.push(mine.length ? "touches" : "touches nothing");
      for (const [a, b, force, state] of mine.slice(0, MOST))
        lines.push(nameOf(a === chosen ? b : a) + ": " + force + " N, " + state);
      if (mine.length > MOST) lines.push("and " + (mine.length - MOST) + " more");
    }
    const now = lines.join("\n");
    if (text.textContent !== now) text.textContent = now;
  };

  // Bodies can be clicked where the server says so, which replays leave out.
  const listen = (page) => {
    for (const node of Object.keys(told.instances)) {
      const known = page.useSceneTree.get(node);
      if (known && known.clickBindings.length === 0)
        page.sceneTreeActions.updateNodeAttributes(node, { clickBindings: [{ button: "left", modifier: null }] });
    }
  };

  const wait = setInterval(() => {
    const page = stateOf();
    if (page === null) return;
    clearInterval(wait);
    page.mutable.current.sendMessage = (message) => {
      const bodies = message.type === "SceneNodeClickMessage" ? told.instances[message.name] : undefined;
      if (bodies === undefined || message.instance_index === null) return;
      chosen = bodies[message.instance_index];
      name.textContent = nameOf(chosen);
      box.style.display = "block";
      show(page);
    };
    setInterval(() => {
      listen(page);
      show(page);
    }, 100);
  }, 100);
})();
